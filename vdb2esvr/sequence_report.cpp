#include "vdb2esvr/sequence_report.h"

#include "cli/memory.h"
#include "vdb2esvr/report.h"

namespace esvr::vdb2esvr {
namespace {

using Json = nlohmann::ordered_json;

constexpr ReportSchema kSequenceSchema{"esvr-sequence", 1};

/// The items of a conversion's report that a sequence has once, or has for the whole run only.
constexpr const char* kOfSequence[]{"schema",           "schema_version", "program",
                                    "command_line",     "versions",       "asked",
                                    "peak_memory_bytes"};

Json outputOf(const FrameRecord& frame) {
  const bool isThere = frame.bytesOut > 0;
  return {{"path", frame.frame.output.string()},
          {"bytes", isThere ? Json(frame.bytesOut) : Json(nullptr)}};
}

Json entryOf(const SequenceRecord& record, const FrameRecord& frame) {
  Json entry{{"frame", frame.frame.number}, {"state", nameOf(frame.state)}};
  entry["held_from"] =
      frame.frame.holds ? Json(record.frames[*frame.frame.holds].frame.number) : Json(nullptr);
  entry["input"] = {{"path", frame.frame.input.string()}};
  entry["output"] = outputOf(frame);
  entry["group"] = frame.group ? Json(*frame.group) : Json(nullptr);
  entry["error"] = nullptr;
  if (frame.report.is_object()) entry.update(frame.report);
  return entry;
}

Json framesOf(const SequenceRecord& record) {
  Json frames = Json::array();
  for (const FrameRecord& frame : record.frames) frames.push_back(entryOf(record, frame));
  return frames;
}

Json rangesOf(const SequenceRecord& record) {
  Json grids = Json::array();
  for (const GridRange& range : gridRanges(record))
    grids.push_back({{"name", range.name},
                     {"frames", range.frames},
                     {"psnr_active", {range.lowestActive, range.highestActive}},
                     {"psnr_box", {range.lowestBox, range.highestBox}}});
  return grids;
}

/// The output of the whole run; a file of all frames has bytes and groups.
Json outputOf(const Options& options, const SequenceRecord& record) {
  Json output{{"path", options.output.string()}};
  if (!record.file) return output;
  output["bytes"] = record.file->bytes ? Json(*record.file->bytes) : Json(nullptr);
  output["groups"] = record.file->groups;
  return output;
}

Json countsOf(const SequenceRecord& record) {
  Json counts;
  for (const FrameState state :
       {FrameState::kConverted, FrameState::kHeld, FrameState::kKept, FrameState::kMissing,
        FrameState::kFailed, FrameState::kInterrupted, FrameState::kNotBegun})
    counts[nameOf(state)] = framesIn(state, record).size();
  return counts;
}

}  // namespace

Json frameReport(Json conversion) {
  for (const char* item : kOfSequence) conversion.erase(item);
  return conversion;
}

Json makeSequenceReport(const Options& options, const SequenceRecord& record) {
  const auto amiss = whatIsAmiss(record);
  Json report = reportHead(options, kSequenceSchema);
  report.update({{"input", {{"path", options.input.string()}}},
                 {"output", outputOf(options, record)},
                 {"states", countsOf(record)},
                 {"grids", rangesOf(record)},
                 {"frames", framesOf(record)},
                 {"seconds", record.seconds},
                 {"peak_memory_bytes", cli::peakMemory()},
                 {"interrupted", record.interrupted},
                 {"exit_code", amiss ? amiss->exitCode() : 0}});
  return report;
}

}  // namespace esvr::vdb2esvr
