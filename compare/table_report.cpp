#include "compare/table_report.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>

#include "cli/bytes_file.h"
#include "cli/json_file.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "compare/report_versions.h"
#include "compare/table_columns.h"
#include "compare/table_lines.h"
#include "compare/table_page.h"
#include "report/data_table.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;
using report::Cell;
using report::DataTable;

constexpr const char* kTableSchema = "esvr-table";
constexpr int kTableVersion = 1;

const std::vector<std::string> kQuality{"name",        "bytes",     "ratio",      "psnr_box",
                                        "psnr_active", "max_error", "p999_error", "ssim",
                                        "iou",         "mass_error"};
const std::vector<std::string> kCost{"name",     "encode_s",     "encode_min_s", "encode_max_s",
                                     "decode_s", "decode_min_s", "decode_max_s", "memory_bytes"};
const std::vector<std::string> kLooks{"name",  "image_psnr", "image_ssim",  "flip",
                                      "lpips", "fps",        "device_bytes"};

/// The consecutive rows of each group.
std::vector<std::span<const TableRow>> groups(const TableRecord& record) {
  std::vector<std::span<const TableRow>> found;
  const std::span<const TableRow> rows(record.rows);
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin;
    while (end < rows.size() && rows[end].group == rows[begin].group) ++end;
    found.push_back(rows.subspan(begin, end - begin));
    begin = end;
  }
  return found;
}

void print(const DataTable& table, std::ostream& out) {
  std::vector<std::string> header;
  for (const auto& column : table.columns) header.push_back(column.header);
  cli::Table text(header);
  for (const auto& row : table.rows) {
    std::vector<std::string> cells;
    for (std::size_t i = 0; i < row.size(); ++i)
      cells.push_back(report::cellText(table.columns[i], row[i]));
    text.add(cells);
  }
  text.print(out);
}

void printNotes(std::span<const TableRow> rows, bool search, std::ostream& out) {
  for (const auto& row : rows) {
    if (!row.note.empty()) out << cli::printable(row.name + ": " + row.note) << '\n';
    if (!row.search.empty())
      out << cli::printable(row.name + ": " + std::to_string(row.search.size()) + " trials" +
                            (row.setting.empty() ? "" : ", " + row.setting))
          << '\n';
    if (!search) continue;
    for (const auto& step : row.search)
      out << "    " << step.setting << ": " << step.bytes << " bytes"
          << (step.psnr ? ", " + cli::decibels(*step.psnr) + " dB" : "") << '\n';
  }
}

std::string markdown(const TableOptions& options, const TableRecord& record) {
  std::string text = "# " + report::markdownText(options.reference.filename().string()) + "\n\n" +
                     report::markdownText(sceneLine(record)) +
                     ". Ratio to the half-float Blosc VDB.\n\n";
  if (record.referenceCost) text += report::markdownText(pictureLine(record)) + "\n\n";
  if (record.interrupted) text += interruption(record) + "\n\n";
  for (const auto rows : groups(record)) {
    DataTable table = withoutEmptyColumns(dataTable(record, rows));
    table.title = rows.front().group;
    text += report::toMarkdown(table) + '\n';
  }
  text += "Made by " + report::markdownCode(joined(options.commandLine)) + " with\n\n";
  for (const auto& line : versionLines()) text += "    " + line + '\n';
  return text;
}

Json toJson(const std::optional<Timing>& timing) {
  if (!timing) return {};
  return {{"median", timing->median},
          {"min", timing->min},
          {"max", timing->max},
          {"runs", timing->runs}};
}

Json searchJson(const TableRow& row) {
  Json steps = Json::array();
  for (const auto& step : row.search) {
    Json entry{{"setting", step.setting}, {"bytes", step.bytes}};
    if (step.psnr) entry["psnr_box"] = std::isfinite(*step.psnr) ? Json(*step.psnr) : Json();
    steps.push_back(std::move(entry));
  }
  return steps;
}

Json rowJson(const TableRow& row, const TableRecord& record) {
  Json json = Json::object();
  for (const auto& column : tableColumns()) {
    const Cell cell = column.of(row, record);
    const auto& key = column.column.key;
    if (const auto* text = std::get_if<std::string>(&cell)) json[key] = *text;
    if (const auto* value = std::get_if<double>(&cell))
      json[key] = std::isfinite(*value) ? Json(*value) : Json();
  }
  if (row.memory) json["memory_bytes"] = *row.memory;
  if (row.bytes) json["bytes"] = *row.bytes;
  if (row.images && row.images->deviceBytes) json["device_bytes"] = *row.images->deviceBytes;
  json["encode"] = toJson(row.encode);
  json["decode"] = toJson(row.decode);
  json["search"] = searchJson(row);
  return json;
}

Json picturesJson(const TableRecord& record) {
  if (!record.referenceCost) return {};
  const auto bytes = record.referenceCost->deviceBytes;
  return {{"device", record.drawnOn},
          {"reference_fps", record.referenceCost->fps},
          {"reference_device_bytes", bytes ? Json(*bytes) : Json()}};
}

Json tableJson(const TableOptions& options, const TableRecord& record) {
  Json rows = Json::array();
  for (const auto& row : record.rows) rows.push_back(rowJson(row, record));
  const Coord a = record.box.min, b = record.box.max;
  return {{"schema", kTableSchema},
          {"schema_version", kTableVersion},
          {"command_line", options.commandLine},
          {"versions", versionJson()},
          {"reference", options.reference.string()},
          {"grid", record.grid},
          {"active_voxels", record.activeVoxels},
          {"box", {a.x, a.y, a.z, b.x, b.y, b.z}},
          {"peak", record.peak},
          {"reference_bytes", record.referenceBytes},
          {"half_blosc_bytes", record.halfBlosc ? Json(*record.halfBlosc) : Json()},
          {"interrupted", record.interrupted},
          {"pictures", picturesJson(record)},
          {"rows", std::move(rows)}};
}

void writeText(const std::string& path, const std::string& text, bool overwrite) {
  if (!path.empty()) cli::writeBytes(path, std::as_bytes(std::span(text)), overwrite);
}

}  // namespace

void printTable(const TableRecord& record, bool search, std::ostream& out) {
  out << cli::printable(sceneLine(record)) << '\n';
  if (record.referenceCost) out << cli::printable(pictureLine(record)) << '\n';
  for (const auto rows : groups(record)) {
    out << "\n" << cli::printable(rows.front().group) << '\n';
    print(withColumns(dataTable(record, rows), kQuality), out);
    out << '\n';
    print(withColumns(dataTable(record, rows), kCost), out);
    if (!record.referencePng.empty()) {
      out << '\n';
      print(withoutEmptyColumns(withColumns(dataTable(record, rows), kLooks)), out);
    }
    printNotes(rows, search, out);
  }
}

void writeReports(const TableOptions& options, const TableRecord& record) {
  const ReportFiles& files = options.files;
  if (!files.json.empty())
    cli::writeJson({files.json, files.overwrite}, tableJson(options, record));
  if (!files.markdown.empty())
    writeText(files.markdown, markdown(options, record), files.overwrite);
  if (!files.csv.empty())
    writeText(files.csv, report::toCsv(dataTable(record, record.rows)), files.overwrite);
  if (!files.html.empty()) writeText(files.html, tablePage(options, record), files.overwrite);
}

}  // namespace esvr::compare
