#include "compare/curves_charts.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "compare/curves_points.h"
#include "compare/error_chart.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using report::Chart;
using report::Series;

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

bool hasFps(const TableRecord& record) {
  return std::any_of(record.rows.begin(), record.rows.end(),
                     [](const TableRow& row) { return row.fps.has_value(); });
}

}  // namespace

std::vector<Chart> curveCharts(const TableRecord& record) {
  std::vector<Chart> charts{overSeconds(record), overBytes(record)};
  if (hasFps(record)) charts.push_back(fpsOverBytes(record));
  std::erase_if(charts, [](const Chart& chart) { return chart.series.empty(); });
  return charts;
}

}  // namespace esvr::compare
