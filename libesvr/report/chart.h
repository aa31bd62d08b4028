#pragma once
/// Charts of pages. The script of a page draws them (charts.js) from the JSON that stands in the page.

#include <string>
#include <vector>

#include "report/emphasis.h"
#include "report/html.h"

namespace esvr::report {

struct Point {
  double x = 0.0, y = 0.0;
  std::string note{};  ///< more about the point, where it is read out
};

struct Series {
  std::string name;
  /// Those that are not finite, or not above 0 on a logarithmic axis, are passed over.
  std::vector<Point> points{};
  Emphasis emphasis = Emphasis::kNone;  ///< kOurs is drawn in front, with a thicker line
  bool joined = true;                   ///< whether a line joins the points, by increasing x
};

/// How the values of an axis are written.
enum class Unit { kNone, kBytes, kSeconds, kPercent };

struct ChartAxis {
  std::string label{};
  Unit unit = Unit::kNone;
  bool logarithmic = false;
};

struct Chart {
  std::string title{};
  ChartAxis x{}, y{};
  std::vector<Series> series{};
  /// Whether a second scale of y has the PSNR of errors, which are percentages of the peak.
  bool decibels = false;
};

[[nodiscard]] Html toHtml(const Chart& chart);

}  // namespace esvr::report
