#include "compare/curves_files.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "cli/bytes_file.h"
#include "cli/json_file.h"
#include "compare/error_plot.h"
#include "compare/finding.h"
#include "compare/page_order.h"
#include "compare/report_versions.h"
#include "compare/table_lines.h"
#include "report/data_table.h"
#include "report/html_chart.h"
#include "report/html_page.h"
#include "report/html_table.h"
#include "report/plot.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using Json = nlohmann::ordered_json;
using report::Cell;
using report::Html;
using report::Kind;
using report::Plot;
using report::Series;

constexpr const char* kCurvesSchema = "esvr-curves";
constexpr int kCurvesVersion = 1;
constexpr const char* kFile = "file";
constexpr const char* kFit = "fit";

/// The curve of a row: rows of the same name form a curve, and all rows of ESVR form one.
std::string seriesOf(const TableRow& row) { return row.group == kOurGroup ? kOurGroup : row.name; }

/// The rows with bytes and figures, sorted by series and by bytes.
std::map<std::string, std::vector<const TableRow*>> rowsBySeries(const TableRecord& record) {
  std::map<std::string, std::vector<const TableRow*>> series;
  for (const auto& row : record.rows)
    if (row.bytes && row.metrics) series[seriesOf(row)].push_back(&row);
  for (auto& [name, rows] : series)
    std::sort(rows.begin(), rows.end(),
              [](const TableRow* a, const TableRow* b) { return *a->bytes < *b->bytes; });
  return series;
}

/// All points: those of kind "fit" are points of a fit's curve, those of kind "file" are files.
report::DataTable points(const TableRecord& record) {
  report::DataTable table{
      {},
      {{"kind", "kind", Kind::kText},
       {"series", "series", Kind::kText},
       {"name", "name", Kind::kText},
       {"bytes", "bytes", Kind::kBytes, "size of the file, bytes"},
       {"seconds", "seconds", Kind::kSeconds},
       {"psnr_box", "PSNR box", Kind::kDecibels, "PSNR over the box, dB"},
       {"psnr_active", "active", Kind::kDecibels, "PSNR over the active voxels, dB"},
       {"max_error", "max error", Kind::kNumber, "largest error of a voxel, value units"},
       {"fps", "FPS", Kind::kNumber, "pictures per second"},
       {"setting", "setting", Kind::kText}},
      {}};
  for (const auto& [series, rows] : rowsBySeries(record))
    for (const TableRow* row : rows) {
      for (const auto& at : row->curve)
        table.rows.push_back({std::string(kFit), series, row->name, double(*row->bytes), at.seconds,
                              at.psnrBox, at.psnrActive, at.maxError, Cell(), Cell()});
      const auto seconds = row->encode ? std::optional(row->encode->median) : std::nullopt;
      table.rows.push_back({std::string(kFile), series, row->name, double(*row->bytes),
                            report::cellOf(seconds), row->metrics->psnrBox,
                            row->metrics->psnrActive, row->metrics->maxError,
                            report::cellOf(row->fps), row->setting});
    }
  return table;
}

/// A curve for each series of rows. \param pointOf  the point of a row
std::vector<Series> curvesOf(const TableRecord& record,
                             const std::function<report::Point(const TableRow&)>& pointOf) {
  std::vector<Series> curves;
  for (const auto& [name, rows] : rowsBySeries(record)) {
    Series series{.name = name};
    if (name == kOurGroup) series.emphasis = report::Emphasis::kOurs;
    for (const TableRow* row : rows) series.points.push_back(pointOf(*row));
    curves.push_back(std::move(series));
  }
  return curves;
}

Plot overBytes(const TableRecord& record) {
  Plot plot = errorOverBytes("Error over bytes");
  plot.series = curvesOf(record, [](const TableRow& row) {
    return errorPoint(double(*row.bytes), row.metrics->psnrBox);
  });
  addDecibels(plot);
  return plot;
}

Plot fpsOverBytes(const TableRecord& record) {
  Plot plot{.title = "Pictures per second over bytes",
            .xLabel = "size of the file",
            .yLabel = "pictures per second",
            .logarithmicX = true,
            .logarithmicY = true,
            .textX = report::bytesText,
            .textY = report::plainText};
  plot.series = curvesOf(record, [](const TableRow& row) {
    return report::Point{double(*row.bytes), row.fps.value_or(NAN)};
  });
  return plot;
}

/// The curves of the fits, and a curve through the end-to-end times from voxels to file.
Plot overSeconds(const TableRecord& record) {
  Plot plot = errorOverSeconds("Error over run time");
  Series ends{.name = "end to end", .emphasis = report::Emphasis::kOurs};
  for (const auto& row : record.rows) {
    if (row.group != kOurGroup || row.curve.empty() || !row.metrics) continue;
    Series series{.name = row.name};
    for (const auto& at : row.curve) series.points.push_back(errorPoint(at.seconds, at.psnrBox));
    plot.series.push_back(std::move(series));
    if (row.fittedHere)
      ends.points.push_back(errorPoint(row.encode->median, row.metrics->psnrBox,
                                       report::bytesText(double(*row.bytes))));
  }
  if (!ends.points.empty()) plot.series.insert(plot.series.begin(), std::move(ends));
  addDecibels(plot);
  return plot;
}

Json toJson(const report::DataTable& table) {
  Json points = Json::array();
  for (const auto& row : table.rows) {
    Json point = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto& key = table.columns[i].key;
      if (const auto* text = std::get_if<std::string>(&row[i])) point[key] = *text;
      if (const auto* value = std::get_if<double>(&row[i]))
        point[key] = std::isfinite(*value) ? Json(*value) : Json();
    }
    points.push_back(std::move(point));
  }
  return points;
}

class Writer {
 public:
  Writer(const std::string& prefix, bool overwrite) : prefix_(prefix), overwrite_(overwrite) {}

  void text(const std::string& ending, const std::string& bytes) const {
    cli::writeBytes(prefix_ + ending, std::as_bytes(std::span(bytes)), overwrite_);
  }
  void json(const Json& json) const { cli::writeJson({prefix_ + ".json", overwrite_}, json); }

 private:
  const std::string& prefix_;
  bool overwrite_;
};

bool hasFps(const TableRecord& record) {
  return std::any_of(record.rows.begin(), record.rows.end(),
                     [](const TableRow& row) { return row.fps.has_value(); });
}

/// A plot and the suffix of its file's name.
struct NamedPlot {
  std::string ending;
  Plot plot;
};

std::vector<NamedPlot> plotsOf(const TableRecord& record) {
  std::vector<NamedPlot> plots{{"-seconds", overSeconds(record)}, {"-bytes", overBytes(record)}};
  if (hasFps(record)) plots.push_back({"-fps", fpsOverBytes(record)});
  return plots;
}

/// The points of a kind, under headings of their series.
report::FigureTable pointsOf(const std::string& kind, report::DataTable points) {
  std::erase_if(points.rows, [&](const report::Row& row) { return row.front() != Cell(kind); });
  report::FigureTable figures{.folded = {"setting"}};
  for (const auto& row : points.rows) {
    const std::string& series = std::get<std::string>(row[1]);
    if (figures.groups.empty() || figures.groups.back().heading != series)
      figures.groups.push_back({series, 0});
    ++figures.groups.back().rows;
  }
  figures.table = withColumns(points, {"name", "bytes", "seconds", "psnr_box", "psnr_active",
                                       "max_error", "fps", "setting"});
  return figures;
}

/// How the files stand out, in the order of the points.
std::vector<report::Emphasis> emphasisOfFiles(const TableRecord& record) {
  const PageOrder order(record);
  std::vector<report::Emphasis> emphasis;
  for (const auto& [series, rows] : rowsBySeries(record))
    for (const TableRow* row : rows) emphasis.push_back(order.emphasisOf(*row));
  return emphasis;
}

Html chartsOf(const std::vector<NamedPlot>& plots) {
  Html charts;
  for (const auto& [ending, plot] : plots)
    if (!plot.series.empty()) charts += report::toHtml(plot);
  return report::element("div", {{"class", "charts"}}, charts);
}

Html foldedPoints(const report::DataTable& data) {
  report::FigureTable fits = pointsOf(kFit, data);
  if (fits.table.rows.empty()) return {};
  fits.table.title = "During the fits: seconds of the optimisation, and errors at that time.";
  Html content = report::element("summary", "Points of the curves over run time");
  content += report::toHtml(fits);
  return report::element("details", {}, content);
}

std::string page(const CurvesReport& report, const report::DataTable& data,
                 const std::vector<NamedPlot>& plots) {
  report::HtmlPage page;
  page.title = report.reference.filename().string();
  page.finding = findingOf(report.record);
  page.paragraphs = {sceneLine(report.record) + ".", page.finding.empty() ? "" : rivalRule(),
                     interruption(report.record)};
  report::FigureTable files = pointsOf(kFile, data);
  files.table.title = "Files: seconds from the voxels to the file; errors in value units.";
  files.emphasis = emphasisOfFiles(report.record);
  Html tables = report::toHtml(files);
  tables += foldedPoints(data);
  page.sections = {report::section("", "Curves", chartsOf(plots)),
                   report::section("figures", "Points", tables)};
  page.commands = versionLines();
  page.commands.insert(page.commands.begin(), joined(report.commandLine));
  return report::toHtml(page);
}

}  // namespace

std::vector<std::filesystem::path> curveFiles(const std::string& prefix, bool fps) {
  std::vector<std::filesystem::path> files;
  for (const char* ending : {".csv", ".json", ".html", "-seconds.svg", "-seconds.png", "-bytes.svg",
                             "-bytes.png", "-fps.svg", "-fps.png"})
    if (fps || !std::string(ending).starts_with("-fps")) files.emplace_back(prefix + ending);
  return files;
}

void writeCurves(const std::string& prefix, const CurvesReport& report, bool overwrite) {
  const Writer writer(prefix, overwrite);
  const TableRecord& record = report.record;
  const report::DataTable data = points(record);
  writer.text(".csv", report::toCsv(data));
  writer.json({{"schema", kCurvesSchema},
               {"schema_version", kCurvesVersion},
               {"command_line", report.commandLine},
               {"grid", record.grid},
               {"peak", record.peak},
               {"interrupted", record.interrupted},
               {"points", toJson(data)}});
  const auto plots = plotsOf(record);
  for (const auto& [ending, plot] : plots) {
    writer.text(ending + ".svg", report::toSvg(plot));
    writer.text(ending + ".png", report::toPng(plot));
  }
  writer.text(".html", page(report, data, plots));
}

}  // namespace esvr::compare
