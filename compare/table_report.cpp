#include "compare/table_report.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>

#include "cli/bytes_file.h"
#include "cli/json_file.h"
#include "cli/printable.h"
#include "cli/table.h"
#include "compare/figures.h"
#include "compare/program.h"
#include "compare/report_versions.h"
#include "report/data_table.h"
#include "report/html_page.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;
using report::Cell;
using report::Column;
using report::DataTable;
using report::Kind;

constexpr const char* kTableSchema = "esvr-table";
constexpr int kTableVersion = 1;

/// A column and the function that gets its figure from a row.
struct TableColumn {
  Column column;
  Cell (*of)(const TableRow&, const TableRecord&);
};

template <auto Member>
Cell metric(const TableRow& row, const TableRecord&) {
  return row.metrics ? Cell(double((*row.metrics).*Member)) : Cell();
}

template <auto Timing_, auto Member>
Cell seconds(const TableRow& row, const TableRecord&) {
  const auto& timing = row.*Timing_;
  return timing ? Cell(double((*timing).*Member)) : Cell();
}

Cell ratio(const TableRow& row, const TableRecord& record) {
  if (!row.bytes || !record.halfBlosc) return {};
  return double(*record.halfBlosc) / double(*row.bytes);
}

Cell ssim(const TableRow& row, const TableRecord&) {
  return row.metrics ? report::cellOf(row.metrics->ssim) : Cell();
}

template <auto Member>
Cell image(const TableRow& row, const TableRecord&) {
  return row.images ? Cell(double((*row.images).*Member)) : Cell();
}

Cell mass(const TableRow& row, const TableRecord&) {
  return row.metrics ? Cell(massError(*row.metrics)) : Cell();
}

Cell deviceMegabytes(const TableRow& row, const TableRecord&) {
  const bool known = row.images && row.images->deviceBytes;
  return known ? Cell(double(*row.images->deviceBytes) / 1e6) : Cell();
}

const std::vector<TableColumn>& tableColumns() {
  using R = TableRow;
  using T = TableRecord;
  using M = VolumeMetrics;
  static const std::vector<TableColumn> columns{
      {{"name", "row", Kind::kText}, [](const R& r, const T&) -> Cell { return r.name; }},
      {{"group", "group", Kind::kText}, [](const R& r, const T&) -> Cell { return r.group; }},
      {{"setting", "setting", Kind::kText}, [](const R& r, const T&) -> Cell { return r.setting; }},
      {{"bytes", "bytes", Kind::kBytes},
       [](const R& r, const T&) { return r.bytes ? Cell(double(*r.bytes)) : Cell(); }},
      {{"ratio", "ratio"}, ratio},
      {{"psnr_box", "PSNR box", Kind::kDecibels}, metric<&M::psnrBox>},
      {{"psnr_active", "active", Kind::kDecibels}, metric<&M::psnrActive>},
      {{"max_error", "max err", Kind::kError}, metric<&M::maxError>},
      {{"p999_error", "p99.9", Kind::kError}, metric<&M::p999Error>},
      {{"ssim", "SSIM", Kind::kShare}, ssim},
      {{"iou", "IoU", Kind::kShare}, metric<&M::iou>},
      {{"mass_error", "mass err", Kind::kError}, mass},
      {{"encode_s", "encode s", Kind::kSeconds}, seconds<&R::encode, &Timing::median>},
      {{"encode_min_s", "min", Kind::kSeconds}, seconds<&R::encode, &Timing::min>},
      {{"encode_max_s", "max", Kind::kSeconds}, seconds<&R::encode, &Timing::max>},
      {{"decode_s", "decode s", Kind::kSeconds}, seconds<&R::decode, &Timing::median>},
      {{"decode_min_s", "min", Kind::kSeconds}, seconds<&R::decode, &Timing::min>},
      {{"decode_max_s", "max", Kind::kSeconds}, seconds<&R::decode, &Timing::max>},
      {{"memory_bytes", "memory MB"},
       [](const R& r, const T&) { return r.memory ? Cell(double(*r.memory) / 1e6) : Cell(); }},
      {{"image_psnr", "image PSNR", Kind::kDecibels}, image<&ImageFigures::psnr>},
      {{"image_ssim", "image SSIM", Kind::kShare}, image<&ImageFigures::ssim>},
      {{"flip", "FLIP", Kind::kShare}, image<&ImageFigures::flip>},
      {{"lpips", "LPIPS"},
       [](const R& r, const T&) { return r.images ? report::cellOf(r.images->lpips) : Cell(); }},
      {{"fps", "FPS"}, [](const R& r, const T&) { return report::cellOf(r.fps); }},
      {{"device_bytes", "device MB"}, deviceMegabytes},
      {{"note", "note", Kind::kText}, [](const R& r, const T&) -> Cell { return r.note; }},
      {{"command", "command", Kind::kText}, [](const R& r, const T&) -> Cell { return r.command; }},
  };
  return columns;
}

DataTable dataTable(const TableRecord& record, std::span<const TableRow> rows) {
  DataTable table;
  for (const auto& column : tableColumns()) table.columns.push_back(column.column);
  for (const auto& row : rows) {
    report::Row cells;
    for (const auto& column : tableColumns()) cells.push_back(column.of(row, record));
    table.rows.push_back(std::move(cells));
  }
  return table;
}

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

std::string sceneLine(const TableRecord& record) {
  return "grid \"" + record.grid + "\", " + std::to_string(record.activeVoxels) +
         " active voxels, box " + toString(record.box.min) + " to " + toString(record.box.max) +
         ", peak " + cli::shortNumber(record.peak);
}

/// A line about the device that drew the pictures and the cost of the reference's.
std::string pictureLine(const TableRecord& record) {
  if (!record.referenceCost) return {};
  const ImageFigures& cost = *record.referenceCost;
  std::string text = "Pictures drawn on " + record.drawnOn + ", the reference's at " +
                     cli::shortNumber(cost.fps) + " pictures per second";
  if (cost.deviceBytes)
    text += ", as a NanoVDB float grid in " + cli::shortNumber(double(*cost.deviceBytes) / 1e6) +
            " MB of the device";
  return text + ".";
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

/// The columns for which at least one row has a figure.
DataTable withoutEmptyColumns(const DataTable& table) {
  std::vector<std::string> keys;
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    for (const auto& row : table.rows)
      if (!report::exactText(row[c]).empty()) {
        keys.push_back(table.columns[c].key);
        break;
      }
  return withColumns(table, keys);
}

std::string interruption(const TableRecord& record) {
  return record.interrupted ? "Interrupted: rows are missing." : "";
}

std::string markdown(const TableOptions& options, const TableRecord& record) {
  std::string text = "# " + options.reference.filename().string() + "\n\n" + sceneLine(record) +
                     ". Ratio to the half-float Blosc VDB.\n\n";
  if (record.referenceCost) text += pictureLine(record) + "\n\n";
  if (record.interrupted) text += interruption(record) + "\n\n";
  for (const auto rows : groups(record)) {
    DataTable table = withoutEmptyColumns(dataTable(record, rows));
    table.title = rows.front().group;
    text += report::toMarkdown(table) + '\n';
  }
  text += "Made by `" + joined(options.commandLine) + "` with\n\n";
  for (const auto& line : versionLines()) text += "    " + line + '\n';
  return text;
}

/// Adds a contact sheet of the rows of similar size, and a slider for each row of ESVR.
void addPictures(const TableRecord& record, report::HtmlPage& page) {
  if (record.referencePng.empty()) return;
  const auto png = [](const std::string& caption, const std::string& bytes) {
    return report::Picture{caption, "image/png", bytes};
  };
  const report::Picture reference = png("reference", record.referencePng);
  page.pictures.push_back(reference);
  for (const auto& row : record.rows) {
    if (!row.images || row.group == "lossless" || row.group == "quantised") continue;
    const std::string name = row.name + ", " + row.group;
    page.pictures.push_back(png(name, row.shown.picturePng));
    page.pictures.push_back(png(name + ": errors, 8 times", row.shown.errorPng));
    if (row.group == "ESVR")
      page.sliders.push_back({"reference on the left, " + row.name + " on the right", reference,
                              png(name, row.shown.picturePng)});
  }
}

std::string html(const TableOptions& options, const TableRecord& record) {
  report::HtmlPage page;
  page.title = "esvr-compare: " + options.reference.filename().string();
  page.paragraphs = {sceneLine(record) + ". Ratio to the half-float Blosc VDB.",
                     pictureLine(record), interruption(record)};
  page.tables = {withoutEmptyColumns(dataTable(record, record.rows))};
  addPictures(record, page);
  page.commands = versionLines();
  page.commands.insert(page.commands.begin(), joined(options.commandLine));
  return report::toHtml(page);
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
  if (!files.html.empty()) writeText(files.html, html(options, record), files.overwrite);
}

}  // namespace esvr::compare
