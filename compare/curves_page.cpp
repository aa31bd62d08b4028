#include "compare/curves_page.h"

#include "compare/curves_charts.h"
#include "compare/curves_points.h"
#include "compare/duel_tables.h"
#include "compare/finding.h"
#include "compare/page_order.h"
#include "compare/report_versions.h"
#include "compare/table_lines.h"
#include "report/chart.h"
#include "report/html_page.h"
#include "report/html_table.h"

namespace esvr::compare {
namespace {

using report::Cell;
using report::Html;

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

Html chartsOf(const TableRecord& record) {
  Html charts;
  for (const report::Chart& chart : curveCharts(record)) charts += report::toHtml(chart);
  return report::element("div", {{"class", "charts"}}, charts);
}

Html foldedPoints(const report::DataTable& data) {
  report::FigureTable fits = pointsOf(kFitPoint, data);
  if (fits.table.rows.empty()) return {};
  fits.table.title = "During the fits: seconds of the optimisation, and errors at that time.";
  Html content = report::element("summary", "Points of the curves over run time");
  content += report::toHtml(fits);
  return report::element("details", {}, content);
}

}  // namespace

std::string curvesPage(const CurvesReport& report) {
  const report::DataTable data = curvePoints(report.record);
  report::HtmlPage page;
  page.title = report.reference.filename().string();
  page.finding = findingOf(report.record);
  page.paragraphs = {sceneLine(report.record) + ".", page.finding.empty() ? "" : rivalRule(),
                     interruption(report.record)};
  report::FigureTable files = pointsOf(kFilePoint, data);
  files.table.title = "Files: seconds from the voxels to the file; errors in value units.";
  files.emphasis = emphasisOfFiles(report.record);
  Html tables = report::toHtml(files);
  tables += foldedPoints(data);
  page.sections = {report::section("", "Curves", chartsOf(report.record)),
                   duelSection(duelsOf(report.record), report.record),
                   report::section("figures", "Points", tables)};
  page.commands = versionLines();
  page.commands.insert(page.commands.begin(), joined(report.commandLine));
  return report::toHtml(page);
}

}  // namespace esvr::compare
