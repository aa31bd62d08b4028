#include "vdb2esvr/report.h"

#include <nlohmann/json.hpp>

#include "cli/json_file.h"
#include "cli/memory.h"
#include "cli/names.h"
#include "cli/version_json.h"
#include "esvr/grid_names.h"
#include "vdb2esvr/asked_report.h"
#include "vdb2esvr/grid_report.h"

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

constexpr ReportSchema kSchema{"esvr-report", 1};

Json gridsOf(const RunRecord& record) {
  Json grids = Json::array();
  for (std::size_t g = 0; g < record.grids.size(); ++g) grids.push_back(gridJson(record, g));
  return grids;
}

/// The metrics of a vector that was not measured, because the run was interrupted, are missing.
Json toJson(const RunRecord& record, const ConvertedVector& vector) {
  Json components = Json::array();
  for (std::size_t c = 0; c < kComponents; ++c) {
    components.push_back({{"name", record.grids[vector.stored.first + c].uniqueName}});
    if (vector.metrics) components.back()["metrics"] = metricsJson(vector.metrics->components[c]);
  }
  Json json{{"name", vector.uniqueName},
            {"value_type", vector.valueType},
            {"bytes", ownBytes(record.output, vector)}};
  if (vector.metrics) json["metrics"] = metricsJson(vector.metrics->magnitude);
  json["components"] = std::move(components);
  return json;
}

Json vectorsOf(const RunRecord& record) {
  Json vectors = Json::array();
  for (const auto& vector : record.vectors) vectors.push_back(toJson(record, vector));
  return vectors;
}

Json toJson(const NotFitted& left) {
  return {{"name", left.grid.uniqueName}, {"value_type", left.grid.valueType}, {"why", left.why}};
}

Json carriedOf(const RunRecord& record) {
  Json carried = Json::array();
  for (std::size_t c = 0; c < record.carried.size(); ++c) {
    Json grid = toJson(record.carried[c]);
    grid["bytes"] = cli::ownBytes(record.output, numberOfCarried(record, c));
    grid["source_bytes"] = record.carried[c].grid.storedBytes;
    carried.push_back(grid);
  }
  return carried;
}

Json skippedOf(const RunRecord& record) {
  Json skipped = Json::array();
  for (const auto& left : record.skipped) skipped.push_back(toJson(left));
  for (const auto& name : record.notFitted)
    skipped.push_back({{"name", name}, {"value_type", nullptr}, {"why", "interrupted"}});
  return skipped;
}

PhaseSeconds sumOf(const std::vector<ConvertedGrid>& grids) {
  PhaseSeconds sum;
  for (const auto& grid : grids) {
    const PhaseSeconds& s = grid.seconds;
    sum.read += s.read, sum.seed += s.seed;
    sum.optimise += s.optimise, sum.encode += s.encode, sum.measure += s.measure;
  }
  return sum;
}

Json totalSeconds(const RunRecord& record) {
  Json seconds = secondsJson(sumOf(record.grids));
  seconds["write"] = record.secondsWrite;
  seconds["total"] = record.secondsTotal;
  return seconds;
}

const char* nameOf(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::kUsage:
      return "usage";
    case ErrorKind::kBadInput:
      return "bad input";
    case ErrorKind::kTargetMissed:
      return "target missed";
    case ErrorKind::kDevice:
      return "device";
    case ErrorKind::kRuntime:
      break;
  }
  return "failure";
}

}  // namespace

bool reportIsFile(const Options& options) {
  return !options.report.empty() && options.report != cli::kStandardOutput;
}

Json reportHead(const Options& options, const ReportSchema& schema) {
  return {{"schema", schema.name},
          {"schema_version", schema.version},
          {"program", kProgram},
          {"command_line", options.commandLine},
          {"versions", cli::versionJson()},
          {"asked", askedJson(options)}};
}

Json makeReport(const Options& options, const RunRecord& record) {
  const Ratio ratio = ratioOf(record);
  Json report = reportHead(options, kSchema);
  report.update({{"input",
                  {{"path", options.input.string()},
                   {"format", record.input.format},
                   {"bytes", record.input.fileBytes},
                   {"bytes_converted", ratio.bytesIn}}},
                 {"output",
                  {{"path", options.output.string()},
                   {"bytes", ratio.bytesOut},
                   {"bytes_separate",
                    record.bytesSeparate > 0 ? Json(record.bytesSeparate) : Json(nullptr)}}},
                 {"ratio", ratio.value()},
                 {"grids", gridsOf(record)},
                 {"vectors", vectorsOf(record)},
                 {"carried", carriedOf(record)},
                 {"skipped", skippedOf(record)},
                 {"seconds", totalSeconds(record)},
                 {"peak_memory_bytes", cli::peakMemory()},
                 {"interrupted", record.interrupted},
                 {"error", nullptr},
                 {"exit_code", exitCodeOf(record)}});
  return report;
}

Json makeFailureReport(const Options& options, const Error& error) {
  Json report = reportHead(options, kSchema);
  report.update({{"input", {{"path", options.input.string()}}},
                 {"error", {{"kind", nameOf(error.kind())}, {"message", error.what()}}},
                 {"exit_code", error.exitCode()}});
  return report;
}

}  // namespace esvr::vdb2esvr
