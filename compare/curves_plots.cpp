#include "compare/curves_plots.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "compare/curves_points.h"
#include "compare/error_plot.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using report::Plot;
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

bool hasFps(const TableRecord& record) {
  return std::any_of(record.rows.begin(), record.rows.end(),
                     [](const TableRow& row) { return row.fps.has_value(); });
}

}  // namespace

std::vector<NamedPlot> curvePlots(const TableRecord& record) {
  std::vector<NamedPlot> plots{{"-seconds", overSeconds(record)}, {"-bytes", overBytes(record)}};
  if (hasFps(record)) plots.push_back({"-fps", fpsOverBytes(record)});
  std::erase_if(plots, [](const NamedPlot& named) { return named.plot.series.empty(); });
  return plots;
}

}  // namespace esvr::compare
