// The command `curves`: its options, the rows that it makes, their points and charts, and the
// files.

#include "compare/table.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "compare/finding.h"
#include "compare/options.h"
#include "compare/report_parts.h"
#include "compare/rows.h"
#include "esvr/error.h"
#include "programs/command_line.h"
#include "programs/data_table.h"
#include "programs/files.h"
#include "programs/option_values.h"
#include "programs/page_figures.h"
#include "programs/resources.h"
#include "programs/run_main.h"

namespace esvr::compare {

using report::Cell;
using report::Chart;
using report::DataTable;
using report::FigureTable;
using report::Html;
using report::Kind;
using report::Series;

// Options.

namespace {

cli::ProgramText curvesText() {
  return {
      .name = std::string(kProgram) + " curves",
      .purpose =
          "Plots error over run time, error over bytes and pictures per second over bytes, for "
          ".esvr files and for VDB and ZFP files of the same sizes.",
      .usage = "  esvr-compare curves REF.vdb [CAND.esvr ...] --output PREFIX [--fit BYTES]...",
      .notes =
          "The program writes every point to PREFIX.csv and PREFIX.json. The page PREFIX.html has "
          "the charts: error over bytes, error over run time if this run makes fits, and pictures "
          "per second over bytes with --fps.\n"
          "\n"
          "Without CAND and --fit, the program fits ellipsoids for six sizes: the size of the "
          "half-float Blosc VDB divided by 10, 20, 50, 100, 200 and 400. The chart over run time "
          "has the time of the optimisation, and the whole time from the voxels to the file.\n"
          "\n"
          "Exit codes: 0 done, 1 failure or interrupted (finished points are written), 2 wrong "
          "options, 3 unusable input, 5 no such device or not enough memory (--max-memory).",
      .examples =
          "  esvr-compare curves smoke.vdb --output curves\n"
          "  esvr-compare curves smoke.vdb 20k.esvr 40k.esvr 80k.esvr --output sizes --fps 400"};
}

cli::CommandLine curvesLine() {
  cli::CommandLine line(curvesText());
  // clang-format off
  line.options().add_options()
    ("output,o", cli::po::value<std::string>()->value_name("PREFIX"),
     "prefix of the names of the written files")
    ("fit", cli::po::value<std::vector<std::string>>()->value_name("BYTES")->composing(),
     "fit ellipsoids for a file of this size; may be repeated")
    ("no-baselines", cli::po::bool_switch(),
     "do not compare with VDB and ZFP files of the same sizes")
    ("fps", cli::po::value<int>()->value_name("PX"),
     "measure the speed of drawing pictures of PX x PX pixels")
    ("force,f", cli::po::bool_switch(), "replace files that exist");
  // clang-format on
  addSceneOptions(line);
  return line;
}

void readSpeed(const cli::Arguments& a, TableOptions& options) {
  constexpr int kMaxPixels = 4096;
  const auto side = a.find<int>("fps");
  if (!side) return;
  cli::requireRange("fps", *side, 1, kMaxPixels);
  options.images.views = 3;  // the median time counts
  options.images.resolution = {*side, *side};
  options.images.transfers = {
      {"viridis:linear", {builtInColorMap("viridis"), builtInOpacity("linear")}}};
}

}  // namespace

std::optional<CurvesOptions> parseCurvesOptions(int argc, const char* const* argv) {
  const auto arguments = curvesLine().parse(argc, argv);
  if (!arguments) return std::nullopt;
  const cli::Arguments& a = *arguments;
  CurvesOptions options;
  TableOptions& table = options.table;
  readSceneOptions(a, table);
  table.matched = table.zfp = !a.get<bool>("no-baselines");
  for (const auto& text : a.all("fit")) table.fits.push_back(cli::parseByteSize("fit", text));
  table.runs = 1;
  readSpeed(a, table);
  table.commandLine = commandLine(argc, argv);
  const auto prefix = a.find<std::string>("output");
  if (!prefix || prefix->empty()) throw UsageError("missing --output PREFIX");
  options.prefix = *prefix;
  options.overwrite = a.get<bool>("force");
  return options;
}

// Rows.

namespace {

/// Default sizes of fits: the size of the half-float Blosc VDB divided by these numbers.
constexpr std::uint64_t kParts[] = {10, 20, 50, 100, 200, 400};

/// Makes the rows of the curves. Finished rows are kept if the run is interrupted.
class CurvesRun {
 public:
  CurvesRun(const TableScene& scene, TableRecord& record, const cli::Log& log)
      : scene_(scene), record_(record), log_(log), maker_(scene) {}

  void run() try {
    for (const auto& path : scene_.options.candidates) add(maker_.candidate(path));
    for (const std::uint64_t bytes : fitSizes()) addFit(bytes);
    std::set<std::uint64_t> sizes;
    for (const auto& row : record_.rows) sizes.insert(*row.bytes);
    for (const std::uint64_t bytes : sizes)
      for (const auto& form : sizeForms(scene_.options)) add(maker_.sizeMatched(form, bytes));
  } catch (const Cancelled&) {
    record_.interrupted = true;
  }

 private:
  [[nodiscard]] std::vector<std::uint64_t> fitSizes() {
    const TableOptions& options = scene_.options;
    if (!options.fits.empty() || !options.candidates.empty()) return options.fits;
    const TableRow half = maker_.baseline("", halfBlosc(), "");
    if (!half.bytes) throw UsageError(half.note + "; set sizes with --fit");
    std::vector<std::uint64_t> sizes;
    for (const std::uint64_t part : kParts) sizes.push_back(*half.bytes / part);
    return sizes;
  }

  /// Adds a fit of a size. A default size may be too small and is then skipped with a warning.
  void addFit(std::uint64_t bytes) try {
    add(maker_.fitted({.bytes = bytes}));
  } catch (const UsageError& error) {
    if (!scene_.options.fits.empty()) throw;
    log_.warning("no fit of " + std::to_string(bytes) + " bytes: " + error.what());
  }

  void add(TableRow row) { addRow(scene_, log_, std::move(row), record_); }

  const TableScene& scene_;
  TableRecord& record_;
  const cli::Log& log_;
  RowMaker maker_;
};

}  // namespace

// Points and charts.

namespace {

/// Kinds of points: those of the curve of a fit, and files.
constexpr const char *kFitPoint = "fit", *kFilePoint = "file";

/// The rows with bytes and figures of each curve, by bytes. Rows of the same name form a curve, and
/// all rows of ESVR form one.
std::map<std::string, std::vector<const TableRow*>> rowsBySeries(const TableRecord& record) {
  std::map<std::string, std::vector<const TableRow*>> series;
  for (const auto& row : record.rows)
    if (row.bytes && row.metrics)
      series[row.group == kOurGroup ? kOurGroup : row.name].push_back(&row);
  for (auto& [name, rows] : series)
    std::sort(rows.begin(), rows.end(),
              [](const TableRow* a, const TableRow* b) { return *a->bytes < *b->bytes; });
  return series;
}

/// All points. Files are in the order of rowsBySeries.
DataTable curvePoints(const TableRecord& record) {
  DataTable table{
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
        table.rows.push_back({std::string(kFitPoint), series, row->name, double(*row->bytes),
                              at.seconds, at.psnrBox, at.psnrActive, at.maxError, Cell(), Cell()});
      const auto seconds = row->encode ? std::optional(row->encode->median) : std::nullopt;
      table.rows.push_back({std::string(kFilePoint), series, row->name, double(*row->bytes),
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

Chart overBytes(const TableRecord& record) {
  Chart chart = errorOverBytes("Error over bytes");
  chart.series = curvesOf(record, [](const TableRow& row) {
    return errorPoint(double(*row.bytes), row.metrics->psnrBox);
  });
  return chart;
}

Chart fpsOverBytes(const TableRecord& record) {
  Chart chart{.title = "Pictures per second over bytes",
              .x = {"size of the file", report::Unit::kBytes, true},
              .y = {"pictures per second", report::Unit::kNone, true}};
  chart.series = curvesOf(record, [](const TableRow& row) {
    return report::Point{double(*row.bytes), row.fps.value_or(NAN)};
  });
  return chart;
}

/// The curves of the fits, and a curve through the end-to-end times from voxels to file.
Chart overSeconds(const TableRecord& record) {
  Chart chart = errorOverSeconds("Error over run time");
  Series ends{.name = "end to end", .emphasis = report::Emphasis::kOurs};
  for (const auto& row : record.rows) {
    if (row.group != kOurGroup || row.curve.empty() || !row.metrics) continue;
    Series series{.name = row.name};
    for (const auto& at : row.curve) series.points.push_back(errorPoint(at.seconds, at.psnrBox));
    chart.series.push_back(std::move(series));
    if (row.fittedHere)
      ends.points.push_back(errorPoint(row.encode->median, row.metrics->psnrBox,
                                       report::bytesText(double(*row.bytes))));
  }
  if (!ends.points.empty()) chart.series.insert(chart.series.begin(), std::move(ends));
  return chart;
}

/// Error over run time, error over bytes and speed over bytes, as far as they were measured.
std::vector<Chart> curveCharts(const TableRecord& record) {
  std::vector<Chart> charts{overSeconds(record), overBytes(record)};
  const auto hasFps = [](const TableRow& row) { return row.fps.has_value(); };
  if (std::ranges::any_of(record.rows, hasFps)) charts.push_back(fpsOverBytes(record));
  std::erase_if(charts, [](const Chart& chart) { return chart.series.empty(); });
  return charts;
}

}  // namespace

// The page and the files.

namespace {

/// The points of a kind, under headings of their series.
FigureTable pointsOf(const std::string& kind, DataTable points) {
  std::erase_if(points.rows, [&](const report::Row& row) { return row.front() != Cell(kind); });
  FigureTable figures{.folded = {"setting"}};
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

Html foldedPoints(const DataTable& data) {
  FigureTable fits = pointsOf(kFitPoint, data);
  if (fits.table.rows.empty()) return {};
  fits.table.title = "During the fits: seconds of the optimisation, and errors at that time.";
  Html content = report::element("summary", "Points of the curves over run time");
  content += report::toHtml(fits);
  return report::element("details", {}, content);
}

/// The page as HTML: the charts, and all points.
std::string curvesPage(const TableOptions& options, const TableRecord& record,
                       const DataTable& data) {
  Html charts;
  for (const Chart& chart : curveCharts(record)) charts += report::toHtml(chart);
  report::HtmlPage page = pageOf(options, record);
  page.paragraphs = {sceneLine(record) + ".", page.finding.empty() ? "" : rivalRule(),
                     interruption(record)};
  FigureTable files = pointsOf(kFilePoint, data);
  files.table.title = "Files: seconds from the voxels to the file; errors in value units.";
  files.emphasis = emphasisOfFiles(record);
  Html tables = report::toHtml(files);
  tables += foldedPoints(data);
  page.sections = {
      report::section("", "Curves", report::element("div", {{"class", "charts"}}, charts)),
      duelSection(duelsOf(record), record), report::section("figures", "Points", tables)};
  return report::toHtml(page);
}

using Json = nlohmann::ordered_json;

constexpr const char* kCurvesSchema = "esvr-curves";
constexpr int kCurvesVersion = 1;

Json toJson(const DataTable& table) {
  Json points = Json::array();
  for (const auto& row : table.rows) {
    Json point = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) addCell(table.columns[i], row[i], point);
    points.push_back(std::move(point));
  }
  return points;
}

/// The output files, whose names begin with a prefix.
std::vector<std::filesystem::path> curveFiles(const std::string& prefix) {
  std::vector<std::filesystem::path> files;
  for (const char* ending : {".csv", ".json", ".html"}) files.emplace_back(prefix + ending);
  return files;
}

/// Writes all files. \throws RuntimeFailure  a file is not writable
void writeCurves(const CurvesOptions& options, const TableRecord& record) {
  const auto write = [&](const char* ending, const std::string& text) {
    cli::writeBytes(options.prefix + ending, std::as_bytes(std::span(text)), options.overwrite);
  };
  const DataTable data = curvePoints(record);
  write(".csv", report::toCsv(data));
  cli::writeJson({options.prefix + ".json", options.overwrite},
                 Json{{"schema", kCurvesSchema},
                      {"schema_version", kCurvesVersion},
                      {"command_line", options.table.commandLine},
                      {"grid", record.grid},
                      {"peak", record.peak},
                      {"interrupted", record.interrupted},
                      {"points", toJson(data)}});
  write(".html", curvesPage(options.table, record, data));
}

}  // namespace

// The command.

void curves(const CurvesOptions& options) {
  const cli::ThreadLimit threads(options.table.threads);
  const cli::Interrupts interrupts;
  const cli::Log log(kProgram, options.table.verbosity);
  const auto outputs = curveFiles(options.prefix);
  cli::requireSeparate(inputsOf(options.table), outputs);
  for (const auto& file : outputs)
    cli::checkOutput(file, {".csv", ".json", ".html"}, options.overwrite);
  const SceneFiles files(options.table, interrupts.token());
  TableRecord record = files.record();
  const TableScene scene = files.scene();
  CurvesRun(scene, record, log).run();
  const Completion completion;  // finished rows are written after an interruption, too
  writeCurves(options, record);
  for (const auto& file : outputs) log.info("wrote " + file.string());
  requireAllRows(record);
}

}  // namespace esvr::compare
