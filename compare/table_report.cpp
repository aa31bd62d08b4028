// The forms of a table: text, Markdown, JSON, CSV and a page.

#include "compare/table_record.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>

#include "compare/figures.h"
#include "compare/finding.h"
#include "compare/options.h"
#include "compare/report_parts.h"
#include "compare/table.h"
#include "programs/data_table.h"
#include "programs/files.h"
#include "programs/messages.h"
#include "programs/page.h"
#include "programs/page_figures.h"

namespace esvr::compare {

using report::Cell;
using report::DataTable;
using report::Emphasis;
using report::FigureTable;
using report::Html;

// Text and Markdown.

namespace {

const std::vector<std::string> kQuality{"name",        "bytes",     "ratio",     "psnr_box",
                                        "psnr_active", "psnr_t50",  "max_error", "p999_error",
                                        "ssim",        "mass_error"};
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

namespace {

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

}  // namespace

// JSON.

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kTableSchema = "esvr-table";
constexpr int kTableVersion = 1;

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
    if (step.psnr) entry["psnr_box"] = finiteOrNull(*step.psnr);
    steps.push_back(std::move(entry));
  }
  return steps;
}

Json rowJson(const TableRow& row, const TableRecord& record) {
  Json json = Json::object();
  for (const auto& column : tableColumns()) addCell(column.column, column.of(row, record), json);
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

}  // namespace

// The page.

namespace {

/// Columns whose figures are folded below their row.
const std::vector<std::string> kFolded{
    "group",        "setting",      "psnr_t90",     "psnr_t10",     "p999_error",
    "mass_error",   "encode_min_s", "encode_max_s", "decode_min_s", "decode_max_s",
    "memory_bytes", "image_ssim",   "device_bytes", "note",         "command"};

constexpr const char* kTableCaption =
    "Ratios are to the half-float Blosc VDB. Errors are in value units. The best figures of a "
    "group are bold.";

/// The cells of a column that are better than another one, and worse than none.
std::vector<std::size_t> bestRows(std::span<const report::Row> rows, std::size_t c) {
  const TableColumn& column = tableColumns()[c];
  const auto isAny = [&](const auto& test) { return std::any_of(rows.begin(), rows.end(), test); };
  std::vector<std::size_t> best;
  for (std::size_t r = 0; r < rows.size(); ++r)
    if (isAny([&](const auto& row) { return isBetter(column, rows[r][c], row[c]); }) &&
        !isAny([&](const auto& row) { return isBetter(column, row[c], rows[r][c]); }))
      best.push_back(r);
  return best;
}

/// Adds a group of rows. Where all rows were searched for one size, no size is the best.
void addGroup(const RowGroup& group, const TableRecord& record, FigureTable& figures) {
  auto& rows = figures.table.rows;
  const std::size_t begin = rows.size();
  for (const TableRow* row : group.rows) rows.push_back(cellsOf(*row, record));
  figures.groups.push_back({group.heading, group.rows.size()});
  for (std::size_t c = 0; c < tableColumns().size(); ++c)
    if (!group.ofOneSize || !isSize(tableColumns()[c]))
      for (const std::size_t r : bestRows(std::span(rows).subspan(begin), c))
        figures.best.push_back({begin + r, c});
}

Html allRows(const TableRecord& record, const PageOrder& order) {
  FigureTable figures{.table = dataTable(record, {}), .folded = kFolded, .reason = "note"};
  for (const auto& group : order.groups()) {
    addGroup(group, record, figures);
    for (const TableRow* row : group.rows) figures.emphasis.push_back(order.emphasisOf(*row));
  }
  figures.table.title = kTableCaption;
  return report::section("figures", "All rows", report::toHtml(figures));
}

Html overview(const TableRecord& record, const PageOrder& order) {
  Html content = duelSection(order.duels(), record);
  content += report::section("", "Error over size", report::toHtml(familiesOverBytes(record)));
  return report::element("div", {{"class", "overview"}}, content);
}

report::Shot shotOf(const TableRow& row, Emphasis emphasis) {
  const ImageFigures& figures = *row.images;
  std::string text = report::bytesText(double(row.bytes.value_or(0))) + ", PSNR of the pictures " +
                     cli::decibels(figures.psnr) + " dB, FLIP " + report::plainText(figures.flip);
  return {row.name, std::move(text), row.shown.picturePng, row.shown.errorPng, emphasis};
}

/// Whether a row is neither near ESVR in size nor in PSNR, so that its pictures say little.
bool isPlain(const TableRow& row) {
  return row.group == kLosslessGroup || row.group == kNearlyLosslessGroup ||
         row.group == kQuantisedGroup;
}

/// ESVR and its rivals first; the pictures of the other rows are folded.
Html pictures(const TableRecord& record, const PageOrder& order) {
  report::PictureSheet sheet{
      .caption = "The first view of each row, and its errors against the picture of the reference.",
      .reference = {.name = "reference", .png = record.referencePng}};
  for (const auto& group : order.groups())
    for (const TableRow* row : group.rows) {
      const Emphasis emphasis = order.emphasisOf(*row);
      if (!row->images || (emphasis == Emphasis::kNone && isPlain(*row))) continue;
      (emphasis == Emphasis::kNone ? sheet.others : sheet.shots).push_back(shotOf(*row, emphasis));
    }
  return report::toHtml(sheet);
}

/// The page as HTML. Rows of ESVR stand beside the rows of their size, and so stand out together
/// with their best rivals.
std::string tablePage(const TableOptions& options, const TableRecord& record) {
  const PageOrder order(record);
  report::HtmlPage page = pageOf(options, record);
  page.paragraphs = {sceneLine(record) + ".", order.duels().empty() ? "" : rivalRule(),
                     pictureLine(record), interruption(record)};
  page.sections = {overview(record, order), allRows(record, order)};
  if (!record.referencePng.empty())
    page.sections.push_back(report::section("pictures", "Pictures", pictures(record, order)));
  return report::toHtml(page);
}

}  // namespace

// Files.

namespace {

void writeText(const std::string& path, const std::string& text, bool overwrite) {
  if (!path.empty()) cli::writeBytes(path, std::as_bytes(std::span(text)), overwrite);
}

}  // namespace

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
