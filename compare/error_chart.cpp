#include "compare/error_chart.h"

#include <algorithm>
#include <cmath>

#include "cli/table.h"
#include "compare/finding.h"

namespace esvr::compare {
namespace {

using report::Chart;
using report::Emphasis;
using report::Point;
using report::Series;

/// The error with which a PSNR is reached, percent of the peak.
double errorOf(double psnr) {
  constexpr double kPercent = 100.0;
  return kPercent * std::pow(10.0, -psnr / 20.0);
}

Chart errorChart(const std::string& title, const report::ChartAxis& x) {
  return {.title = title,
          .x = x,
          .y = {"RMS error over the box, % of the peak", report::Unit::kPercent, true},
          .decibels = true};
}

/// The first word of a row's name: OpenVDB, NanoVDB, ZFP.
std::string familyOf(const TableRow& row) {
  return row.group == kOurGroup ? kOurGroup : row.name.substr(0, row.name.find(' '));
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

Point errorPoint(double x, double psnr, const std::string& note) {
  return {x, errorOf(psnr), cli::decibels(psnr) + " dB" + (note.empty() ? "" : "\n" + note)};
}

Chart familiesOverBytes(const TableRecord& record) {
  Chart chart = errorOverBytes("All rows but those without an error");
  for (const auto& row : record.rows) {
    if (!row.bytes || !row.metrics) continue;
    Series& series = seriesNamed(familyOf(row), chart);
    if (row.group == kOurGroup) series.emphasis = Emphasis::kOurs;
    series.points.push_back(errorPoint(double(*row.bytes), row.metrics->psnrBox, row.name));
  }
  return chart;
}

}  // namespace esvr::compare
