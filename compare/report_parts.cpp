#include "compare/report_parts.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "compare/figures.h"
#include "compare/options.h"
#include "compare/table.h"
#include "programs/data_table.h"
#include "programs/messages.h"
#include "programs/page.h"
#include "programs/page_figures.h"

namespace esvr::compare {

using report::Cell;
using report::Chart;
using report::DataTable;
using report::FigureTable;
using report::Html;
using report::Kind;
using report::Series;

// Sentences.

std::string sceneLine(const TableRecord& record) {
  return "grid \"" + record.grid + "\", " + cli::counted(record.activeVoxels, "active voxel") +
         ", box " + toString(record.box.min) + " to " + toString(record.box.max) + ", peak " +
         cli::shortNumber(record.peak);
}

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

std::string rivalRule() {
  constexpr double kPercent = 100.0;
  return "The best rival is the row with the highest PSNR over the box among all rows that are not "
         "more than " +
         cli::shortNumber(kPercent * kSameSize) + " % larger than the file of ESVR.";
}

std::string interruption(const TableRecord& record) {
  return record.interrupted ? "Interrupted: rows are missing." : "";
}

// Columns.

namespace {

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

}  // namespace

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

bool isBetter(const TableColumn& column, const Cell& cell, const Cell& than) {
  const auto *a = std::get_if<double>(&cell), *b = std::get_if<double>(&than);
  if (!a || !b || cellText(column.column, cell) == cellText(column.column, than)) return false;
  return column.better == Better::kLess ? *a < *b : column.better == Better::kMore && *a > *b;
}

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

void addCell(const report::Column& column, const Cell& cell, nlohmann::ordered_json& json) {
  if (const auto* text = std::get_if<std::string>(&cell)) json[column.key] = *text;
  if (const auto* value = std::get_if<double>(&cell)) json[column.key] = finiteOrNull(*value);
}

report::HtmlPage pageOf(const TableOptions& options, const TableRecord& record) {
  report::HtmlPage page{.title = options.reference.filename().string(),
                        .finding = findingOf(record),
                        .commands = versionLines()};
  page.commands.insert(page.commands.begin(), joined(options.commandLine));
  return page;
}

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

namespace {

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

}  // namespace

Html duelSection(const std::vector<Duel>& duels, const TableRecord& record) {
  const auto hasRival = [](const Duel& duel) { return duel.rival != nullptr; };
  if (std::none_of(duels.begin(), duels.end(), hasRival)) return {};
  if (duels.size() > 1)
    return report::section("duels", "ESVR and its best rivals", duelsTable(duels));
  return report::section("duel", "ESVR and its best rival", duelTable(duels.front(), record));
}

// Charts.

namespace {

Chart errorChart(const std::string& title, const report::ChartAxis& x) {
  return {.title = title,
          .x = x,
          .y = {"RMS error over the box, % of the peak", report::Unit::kPercent, true},
          .decibels = true};
}

Series& seriesNamed(const std::string& name, Chart& chart) {
  const auto named = [&](const Series& series) { return series.name == name; };
  const auto found = std::find_if(chart.series.begin(), chart.series.end(), named);
  if (found != chart.series.end()) return *found;
  chart.series.push_back({.name = name, .joined = false});
  return chart.series.back();
}

}  // namespace

Chart errorOverBytes(const std::string& title) {
  return errorChart(title, {"size of the file", report::Unit::kBytes, true});
}

Chart errorOverSeconds(const std::string& title) {
  return errorChart(title, {"run time", report::Unit::kSeconds, true});
}

report::Point errorPoint(double x, double psnr, const std::string& note) {
  constexpr double kPercent = 100.0;
  return {x, kPercent * std::pow(10.0, -psnr / 20.0),
          cli::decibels(psnr) + " dB" + (note.empty() ? "" : "\n" + note)};
}

Chart familiesOverBytes(const TableRecord& record) {
  Chart chart = errorOverBytes("All rows but those without an error");
  for (const auto& row : record.rows) {
    if (!row.bytes || !row.metrics) continue;
    // A family has the first word of its rows' names: OpenVDB, NanoVDB, ZFP.
    const bool isOurs = row.group == kOurGroup;
    Series& series =
        seriesNamed(isOurs ? kOurGroup : row.name.substr(0, row.name.find(' ')), chart);
    if (isOurs) series.emphasis = report::Emphasis::kOurs;
    series.points.push_back(errorPoint(double(*row.bytes), row.metrics->psnrBox, row.name));
  }
  return chart;
}

}  // namespace esvr::compare
