#include "compare/check_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>

#include "cli/printable.h"
#include "cli/table.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCheckSchema = "esvr-check";
constexpr int kCheckVersion = 1;

/// The figures that any grid has.
std::vector<Figure> columns(const CheckRecord& record) {
  std::vector<Figure> shown;
  for (const Figure& figure : allFigures())
    if (std::ranges::any_of(record.grids, [&](const CheckedGrid& grid) {
          return valueOf(grid.figures, figure).has_value();
        }))
      shown.push_back(figure);
  return shown;
}

/// The figure of a grid as text; a grid of the first frame has no temporal difference.
std::string cellOf(const CheckedGrid& grid, const Figure& figure) {
  const auto value = valueOf(grid.figures, figure);
  return value ? textOf(figure, *value) : "-";
}

void printFigures(const CheckRecord& record, std::ostream& out) {
  if (record.grids.empty()) return;
  const auto shown = columns(record);
  std::vector<std::string> header{"grid"};
  for (const Figure& figure : shown) header.push_back(figure.header);
  cli::Table table(header);
  for (const auto& grid : record.grids) {
    std::vector<std::string> row{grid.name};
    for (const Figure& figure : shown) row.push_back(cellOf(grid, figure));
    table.add(row);
  }
  table.print(out);
}

void printLines(std::ostream& out, const std::string& prefix,
                const std::vector<Difference>& differences) {
  for (const auto& difference : differences)
    out << cli::printable(prefix + difference.text) << '\n';
}

void printLines(std::ostream& out, const std::string& prefix,
                const std::vector<std::string>& lines) {
  for (const auto& line : lines) out << cli::printable(prefix + line) << '\n';
}

const char* nameOf(DifferenceKind kind) {
  switch (kind) {
    case DifferenceKind::kName:
      return "name";
    case DifferenceKind::kClass:
      return "class";
    case DifferenceKind::kValueType:
      return "type";
    case DifferenceKind::kBackground:
      return "background";
    case DifferenceKind::kTransform:
      return "transform";
    case DifferenceKind::kInactive:
      return "inactive";
    case DifferenceKind::kMetadata:
      break;
  }
  return "metadata";
}

Json toJson(const std::vector<Difference>& differences) {
  Json list = Json::array();
  for (const auto& d : differences) list.push_back({{"kind", nameOf(d.kind)}, {"text", d.text}});
  return list;
}

Json toJson(const CheckedGrid& grid) {
  Json json{{"name", grid.name}, {"candidate_name", grid.candidateName}};
  for (const Figure& figure : allFigures()) {
    const auto value = valueOf(grid.figures, figure);
    if (value) json[figure.key] = std::isfinite(*value) ? Json(*value) : Json();
  }
  const Coord at = grid.metrics.maxErrorAt;
  json["frame"] = grid.frame ? Json(*grid.frame) : Json(nullptr);
  json["max_error_at"] = {at.x, at.y, at.z};
  json["peak"] = grid.metrics.peak > 0.0 ? Json(grid.metrics.peak) : Json();
  json["differences"] = toJson(grid.differences);
  return json;
}

}  // namespace

void printCheck(const CheckRecord& record, std::ostream& out) {
  printFigures(record, out);
  printLines(out, "file ", record.fileDifferences);
  for (const auto& grid : record.grids)
    printLines(out, "grid \"" + grid.name + "\": ", grid.differences);
  for (const auto& name : record.extra)
    out << cli::printable("grid \"" + name + "\" is not in the reference") << '\n';
  printLines(out, "", record.same);
  printLines(out, "skipped ", record.skipped);
  printLines(out, "", record.notes);
}

Json checkReport(const CheckOptions& options, const CheckRecord& record) {
  Json grids = Json::array();
  for (const auto& grid : record.grids) grids.push_back(toJson(grid));
  return {{"schema", kCheckSchema},
          {"schema_version", kCheckVersion},
          {"command_line", options.commandLine},
          {"reference", options.reference.string()},
          {"candidate", options.candidate.string()},
          {"bytes", record.candidateBytes},
          {"grids", std::move(grids)},
          {"file_differences", toJson(record.fileDifferences)},
          {"extra", record.extra},
          {"same", record.same},
          {"skipped", record.skipped},
          {"failures", record.failures},
          {"unreadable", record.unreadable},
          {"notes", record.notes}};
}

}  // namespace esvr::compare
