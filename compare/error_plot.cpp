#include "compare/error_plot.h"

#include <algorithm>
#include <cmath>

#include "cli/table.h"
#include "compare/finding.h"
#include "report/units.h"

namespace esvr::compare {
namespace {

using report::Emphasis;
using report::Plot;
using report::Point;
using report::Series;

/// The error with which a PSNR is reached, percent of the peak.
double errorOf(double psnr) {
  constexpr double kPercent = 100.0;
  return kPercent * std::pow(10.0, -psnr / 20.0);
}
double psnrOf(double error) { return -20.0 * std::log10(error / errorOf(0.0)); }

Plot errorPlot(const std::string& title) {
  return {.title = title,
          .yLabel = "RMS error over the box, % of the peak",
          .logarithmicX = true,
          .logarithmicY = true,
          .textY = report::percentText};
}

/// The first word of a row's name: OpenVDB, NanoVDB, ZFP.
std::string familyOf(const TableRow& row) {
  return row.group == kOurGroup ? kOurGroup : row.name.substr(0, row.name.find(' '));
}

Series& seriesNamed(const std::string& name, Plot& plot) {
  const auto named = [&](const Series& series) { return series.name == name; };
  const auto found = std::find_if(plot.series.begin(), plot.series.end(), named);
  if (found != plot.series.end()) return *found;
  plot.series.push_back({.name = name, .joined = false});
  return plot.series.back();
}

}  // namespace

Plot errorOverBytes(const std::string& title) {
  Plot plot = errorPlot(title);
  plot.xLabel = "size of the file";
  plot.textX = report::bytesText;
  return plot;
}

Plot errorOverSeconds(const std::string& title) {
  Plot plot = errorPlot(title);
  plot.xLabel = "run time";
  plot.textX = report::secondsText;
  return plot;
}

Point errorPoint(double x, double psnr, const std::string& note) {
  return {x, errorOf(psnr), cli::decibels(psnr) + " dB" + (note.empty() ? "" : "\n" + note)};
}

void addDecibels(Plot& plot) {
  constexpr double kIntervals = 6.0;
  double least = INFINITY, most = -INFINITY;
  for (const auto& series : plot.series)
    for (const auto& point : series.points) {
      if (!(point.y > 0.0)) continue;
      least = std::min(least, psnrOf(point.y));
      most = std::max(most, psnrOf(point.y));
    }
  if (!(least < most)) return;
  plot.rightLabel = "PSNR, dB";
  plot.rightTicks = report::roundTicks(least, most, kIntervals);
  for (auto& tick : plot.rightTicks) tick.value = errorOf(tick.value);
}

Plot familiesOverBytes(const TableRecord& record) {
  Plot plot = errorOverBytes("All rows but those without an error");
  for (const auto& row : record.rows) {
    if (!row.bytes || !row.metrics) continue;
    Series& series = seriesNamed(familyOf(row), plot);
    if (row.group == kOurGroup) series.emphasis = Emphasis::kOurs;
    series.points.push_back(errorPoint(double(*row.bytes), row.metrics->psnrBox, row.name));
  }
  addDecibels(plot);
  return plot;
}

}  // namespace esvr::compare
