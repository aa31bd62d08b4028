// The forms of a table: text, Markdown, JSON, CSV and a page.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <ostream>
#include <span>

#include "compare/figures.h"
#include "compare/table.h"
#include "compare/table_record.h"
#include "esvr/baseline.h"
#include "programs/files.h"
#include "programs/page_figures.h"
#include "programs/run_main.h"

namespace esvr::compare {
namespace {

using report::Cell;
using report::Chart;
using report::DataTable;
using report::Emphasis;
using report::FigureTable;
using report::Html;
using report::Kind;
using report::Series;
using Json = nlohmann::ordered_json;

// What made the table.

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// One line for the program, the format and each library.
std::vector<std::string> versionLines() {
  std::vector<std::string> lines;
  std::string text = cli::versionText(kProgram);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  if (!zfpVersion().empty()) lines.push_back(zfpVersion());
  return lines;
}

/// The versions that reports of all programs have, and that of ZFP; null if there is none.
Json versionJson() {
  Json versions = cli::versionJson();
  versions["zfp"] = nullptr;
  if (!zfpVersion().empty()) versions["zfp"] = zfpVersion();
  return versions;
}

// Sentences.

/// The grid, its voxels, the box and the peak.
std::string sceneLine(const TableRecord& record) {
  return "grid \"" + record.grid + "\", " + cli::counted(record.activeVoxels, "active voxel") +
         ", box " + toString(record.box.min) + " to " + toString(record.box.max) + ", peak " +
         cli::shortNumber(record.peak);
}

/// The device that drew the pictures and the cost of the reference's; empty without pictures.
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

/// Which rows are rivals (Duel).
std::string rivalRule() {
  constexpr double kPercent = 100.0;
  return "The best rival is the row with the highest PSNR over the box among all rows that are not "
         "more than " +
         cli::shortNumber(kPercent * kSameSize) + " % larger than the file of ESVR.";
}

/// Whether rows are missing; empty if not.
std::string interruption(const TableRecord& record) {
  return record.interrupted ? "Interrupted: rows are missing." : "";
}

// Columns.

/// Which figures are better.
enum class Better { kNeither, kLess, kMore };

/// A column and the function that gets its figure from a row.
struct TableColumn {
  report::Column column;
  Cell (*of)(const TableRow&, const TableRecord&);
  Better better = Better::kNeither;
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

template <auto Member>
Cell light(const TableRow& row, const TableRecord&) {
  if (!row.metrics || !row.metrics->transmittance) return {};
  return (*row.metrics->transmittance).*Member;
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

Cell lpips(const TableRow& row, const TableRecord&) {
  return row.images ? report::cellOf(row.images->lpips) : Cell();
}

Cell countOf(const std::optional<std::uint64_t>& count) {
  return count ? Cell(double(*count)) : Cell();
}
Cell bytes(const TableRow& row, const TableRecord&) { return countOf(row.bytes); }
Cell memory(const TableRow& row, const TableRecord&) { return countOf(row.memory); }
Cell deviceMemory(const TableRow& row, const TableRecord&) {
  return row.images ? countOf(row.images->deviceBytes) : Cell();
}

const std::vector<TableColumn>& tableColumns() {
  using R = TableRow;
  using T = TableRecord;
  using M = VolumeMetrics;
  constexpr Better kLess = Better::kLess, kMore = Better::kMore;
  static const std::vector<TableColumn> columns{
      {{"name", "row", Kind::kText, "the form in which the volume is stored"},
       [](const R& r, const T&) -> Cell { return r.name; }},
      {{"group", "group", Kind::kText}, [](const R& r, const T&) -> Cell { return r.group; }},
      {{"setting", "setting", Kind::kText}, [](const R& r, const T&) -> Cell { return r.setting; }},
      {{"bytes", "bytes", Kind::kBytes, "size of the file, bytes"}, bytes, kLess},
      {{"ratio", "ratio", Kind::kNumber, "size of the half-float Blosc VDB divided by this size"},
       ratio,
       kMore},
      {{"psnr_active", "active", Kind::kDecibels, "PSNR over the active voxels, dB"},
       metric<&M::psnrActive>,
       kMore},
      {{"psnr_box", "PSNR box", Kind::kDecibels, "PSNR over the box, dB"},
       metric<&M::psnrBox>,
       kMore},
      {{"psnr_t90", "T 0.9", Kind::kDecibels,
        "PSNR of the transmittance, where the median column lets 90 % of the light through, dB"},
       light<&TransmittancePsnr::psnr90>,
       kMore},
      {{"psnr_t50", "T 0.5", Kind::kDecibels,
        "PSNR of the transmittance, where the median column lets 50 % of the light through, dB"},
       light<&TransmittancePsnr::psnr50>,
       kMore},
      {{"psnr_t10", "T 0.1", Kind::kDecibels,
        "PSNR of the transmittance, where the median column lets 10 % of the light through, dB"},
       light<&TransmittancePsnr::psnr10>,
       kMore},
      {{"max_error", "max err", Kind::kError, "largest error of a voxel, value units"},
       metric<&M::maxError>,
       kLess},
      {{"p999_error", "p99.9", Kind::kError,
        "error that 99.9 % of the voxels do not exceed, value units"},
       metric<&M::p999Error>,
       kLess},
      {{"ssim", "SSIM", Kind::kShare, "SSIM of the voxels"}, ssim, kMore},
      {{"iou", "IoU", Kind::kShare, "intersection over union of the active voxels"},
       metric<&M::iou>,
       kMore},
      {{"mass_error", "mass err", Kind::kError, "relative error of the sum of the values"},
       mass,
       kLess},
      {{"encode_s", "encode s", Kind::kSeconds, "time to encode, seconds"},
       seconds<&R::encode, &Timing::median>,
       kLess},
      {{"encode_min_s", "min", Kind::kSeconds, "shortest time to encode, seconds"},
       seconds<&R::encode, &Timing::min>},
      {{"encode_max_s", "max", Kind::kSeconds, "longest time to encode, seconds"},
       seconds<&R::encode, &Timing::max>},
      {{"decode_s", "decode s", Kind::kSeconds, "time to decode, seconds"},
       seconds<&R::decode, &Timing::median>,
       kLess},
      {{"decode_min_s", "min", Kind::kSeconds, "shortest time to decode, seconds"},
       seconds<&R::decode, &Timing::min>},
      {{"decode_max_s", "max", Kind::kSeconds, "longest time to decode, seconds"},
       seconds<&R::decode, &Timing::max>},
      {{"memory_bytes", "memory MB", Kind::kMegabytes, "memory of encoding and decoding, MB"},
       memory,
       kLess},
      {{"image_psnr", "image PSNR", Kind::kDecibels, "PSNR of the pictures, dB"},
       image<&ImageFigures::psnr>,
       kMore},
      {{"image_ssim", "image SSIM", Kind::kShare, "SSIM of the pictures"},
       image<&ImageFigures::ssim>,
       kMore},
      {{"flip", "FLIP", Kind::kShare, "FLIP of the pictures"}, image<&ImageFigures::flip>, kLess},
      {{"lpips", "LPIPS", Kind::kNumber, "LPIPS of the pictures"}, lpips, kLess},
      {{"fps", "FPS", Kind::kNumber, "pictures per second"},
       [](const R& r, const T&) { return report::cellOf(r.fps); },
       kMore},
      {{"device_bytes", "device MB", Kind::kMegabytes, "device memory that drawing held, MB"},
       deviceMemory,
       kLess},
      {{"note", "note", Kind::kText}, [](const R& r, const T&) -> Cell { return r.note; }},
      {{"command", "command", Kind::kText}, [](const R& r, const T&) -> Cell { return r.command; }},
  };
  return columns;
}

/// Whether a figure of a column is better than another one. Figures that look the same are equally
/// good.
bool isBetter(const TableColumn& column, const Cell& cell, const Cell& than) {
  const auto *a = std::get_if<double>(&cell), *b = std::get_if<double>(&than);
  if (!a || !b || cellText(column.column, cell) == cellText(column.column, than)) return false;
  return column.better == Better::kLess ? *a < *b : column.better == Better::kMore && *a > *b;
}

/// Whether the figures of a column say only how large a file is.
bool isSize(const TableColumn& column) {
  return column.column.key == "bytes" || column.column.key == "ratio";
}

report::Row cellsOf(const TableRow& row, const TableRecord& record) {
  report::Row cells;
  for (const auto& column : tableColumns()) cells.push_back(column.of(row, record));
  return cells;
}

DataTable dataTable(const TableRecord& record, std::span<const TableRow> rows) {
  DataTable table;
  for (const auto& column : tableColumns()) table.columns.push_back(column.column);
  for (const auto& row : rows) table.rows.push_back(cellsOf(row, record));
  return table;
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

// Duels.

/// The figures of a duel, one in a line. Sizes say something only where both have no error.
Html duelTable(const Duel& duel, const TableRecord& record) {
  const bool ofOneSize = std::isfinite(duel.ours->metrics->psnrBox);
  FigureTable figures{.sortable = false};
  DataTable& table = figures.table;
  table.columns = {
      {"figure", "figure", Kind::kText}, {"ours", duel.ours->name}, {"rival", duel.rival->name}};
  table.title = "The better figures are bold.";
  for (const auto& column : tableColumns()) {
    const Cell ours = column.of(*duel.ours, record), rival = column.of(*duel.rival, record);
    if (column.better == Better::kNeither || report::exactText(ours).empty()) continue;
    const bool counts = !(ofOneSize && isSize(column));
    if (counts && isBetter(column, ours, rival)) figures.best.push_back({table.rows.size(), 1});
    if (counts && isBetter(column, rival, ours)) figures.best.push_back({table.rows.size(), 2});
    table.rows.push_back(
        {column.column.meaning, cellText(column.column, ours), cellText(column.column, rival)});
  }
  return report::toHtml(figures);
}

/// The PSNR of ESVR and of its best rivals, a line for each file of ESVR.
Html duelsTable(const std::vector<Duel>& duels) {
  FigureTable figures{.sortable = false};
  DataTable& table = figures.table;
  table.title =
      "PSNR over the box in dB: that of ESVR, that of its best rival, and the lead of ESVR.";
  table.columns = {{"size", "size", Kind::kText, "size of the file of ESVR"},
                   {"ours", "ESVR", Kind::kDecibels, "PSNR of ESVR, dB"},
                   {"name", "best rival", Kind::kText},
                   {"rival", "PSNR", Kind::kDecibels, "PSNR of the best rival, dB"},
                   {"lead", "lead", Kind::kDecibels, "difference of both, dB"}};
  for (const Duel& duel : duels) {
    report::Row cells{report::bytesText(double(*duel.ours->bytes)), duel.ours->metrics->psnrBox,
                      std::string("none"), Cell(), Cell()};
    if (duel.rival) {
      cells[2] = duel.rival->name;
      cells[3] = duel.rival->metrics->psnrBox;
      if (std::isfinite(leadOf(duel))) cells[4] = leadOf(duel);
    }
    table.rows.push_back(std::move(cells));
  }
  return report::toHtml(figures);
}

/// A section with all figures of one duel, or with the PSNR of several; nothing if no row has a
/// rival.
Html duelSection(const std::vector<Duel>& duels, const TableRecord& record) {
  const auto hasRival = [](const Duel& duel) { return duel.rival != nullptr; };
  if (std::none_of(duels.begin(), duels.end(), hasRival)) return {};
  if (duels.size() > 1)
    return report::section("duels", "ESVR and its best rivals", duelsTable(duels));
  return report::section("duel", "ESVR and its best rival", duelTable(duels.front(), record));
}

// Charts.

/// A chart of errors on logarithmic axes, without series. Its axis has the root mean square error over the
/// box as a share of the peak, and PSNR as a second scale.
Chart errorChart(const std::string& title, const report::ChartAxis& x) {
  return {.title = title,
          .x = x,
          .y = {"RMS error over the box, % of the peak", report::Unit::kPercent, true},
          .decibels = true};
}

/// A point of such a chart. Where there is no error, the point is not shown.
/// \param note  what to say about the point besides its values
report::Point errorPoint(double x, double psnr, const std::string& note = {}) {
  constexpr double kPercent = 100.0;
  return {x, kPercent * std::pow(10.0, -psnr / 20.0),
          cli::decibels(psnr) + " dB" + (note.empty() ? "" : "\n" + note)};
}

Series& seriesNamed(const std::string& name, Chart& chart) {
  const auto named = [&](const Series& series) { return series.name == name; };
  const auto found = std::find_if(chart.series.begin(), chart.series.end(), named);
  if (found != chart.series.end()) return *found;
  chart.series.push_back({.name = name, .joined = false});
  return chart.series.back();
}

/// The families of all rows (ESVR, OpenVDB, NanoVDB, ZFP, ...) over the size of their files.
Chart familiesOverBytes(const TableRecord& record) {
  Chart chart = errorChart("All rows but those without an error",
                           {"size of the file", report::Unit::kBytes, true});
  for (const auto& row : record.rows) {
    if (!row.bytes || !row.metrics) continue;
    // A family has the first word of its rows' names: OpenVDB, NanoVDB, ZFP.
    const bool isOurs = row.group == kOurGroup;
    Series& series =
        seriesNamed(isOurs ? kOurGroup : row.name.substr(0, row.name.find(' ')), chart);
    if (isOurs) series.emphasis = Emphasis::kOurs;
    series.points.push_back(errorPoint(double(*row.bytes), row.metrics->psnrBox, row.name));
  }
  return chart;
}

/// The curves of the fits that the command has made, and a curve through the times from the voxels to the file.
Chart fitsOverSeconds(const TableRecord& record) {
  Chart chart = errorChart("Fits of this command", {"run time", report::Unit::kSeconds, true});
  Series ends{.name = "end to end", .emphasis = Emphasis::kOurs};
  for (const auto& row : record.rows) {
    if (row.curve.empty() || !row.metrics) continue;
    Series series{.name = row.name};
    for (const auto& at : row.curve) series.points.push_back(errorPoint(at.seconds, at.psnrBox));
    chart.series.push_back(std::move(series));
    ends.points.push_back(errorPoint(row.encode->median, row.metrics->psnrBox,
                                     report::bytesText(double(*row.bytes))));
  }
  if (!ends.points.empty()) chart.series.insert(chart.series.begin(), std::move(ends));
  return chart;
}

// Text and Markdown.

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

// JSON.

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
  for (const auto& column : tableColumns()) {
    const Cell cell = column.of(row, record);
    if (const auto* text = std::get_if<std::string>(&cell)) json[column.column.key] = *text;
    if (const auto* value = std::get_if<double>(&cell))
      json[column.column.key] = finiteOrNull(*value);
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

// The page.

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
  if (const Chart fits = fitsOverSeconds(record); !fits.series.empty())
    content += report::section("", "Error over run time", report::toHtml(fits));
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
  report::HtmlPage page{.title = options.reference.filename().string(),
                        .finding = findingOf(record),
                        .commands = versionLines()};
  page.commands.insert(page.commands.begin(), joined(options.commandLine));
  page.paragraphs = {sceneLine(record) + ".", order.duels().empty() ? "" : rivalRule(),
                     pictureLine(record), interruption(record)};
  page.sections = {overview(record, order), allRows(record, order)};
  if (!record.referencePng.empty())
    page.sections.push_back(report::section("pictures", "Pictures", pictures(record, order)));
  return report::toHtml(page);
}

// Files.

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
