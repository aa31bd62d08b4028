#pragma once
/// Plots of curves, drawn by cairo as SVG and as PNG.

#include <string>
#include <vector>

#include "report/axis.h"
#include "report/emphasis.h"

namespace esvr::report {

struct Point {
  double x = 0.0, y = 0.0;
  std::string note{};  ///< more about the point, where it is read out
};

struct Series {
  std::string name;
  /// In the order of the line; those that are not finite, or not above 0 on a logarithmic axis, are
  /// passed over.
  std::vector<Point> points{};
  Emphasis emphasis = Emphasis::kNone;  ///< kOurs is drawn with a thicker line
  bool joined = true;                   ///< whether a line joins the points
};

struct Plot {
  std::string title{}, xLabel{}, yLabel{};  ///< labels have the unit
  bool logarithmicX = false, logarithmicY = false;
  /// Texts of values; if there is no function, they are numbers.
  std::string (*textX)(double) = nullptr, (*textY)(double) = nullptr;
  std::vector<Series> series{};
  std::string rightLabel{};  ///< name of a second scale of y
  std::vector<Tick>
      rightTicks{};               ///< its ticks, at values of y; those beyond the axis are left out
  int width = 900, height = 560;  ///< pixels
};

/// The axes of a plot.
struct PlotAxes {
  explicit PlotAxes(const Plot& plot);
  [[nodiscard]] bool hold(const Point& point) const { return x.holds(point.x) && y.holds(point.y); }

  Axis x, y;
};

/// The label of a tick of an axis of a plot. \param textOf  Plot::textX or Plot::textY
[[nodiscard]] std::string labelOf(const Tick& tick, std::string (*textOf)(double));

/// \throws RuntimeFailure  cairo reports an error (the text is cairo's)
[[nodiscard]] std::string toSvg(const Plot& plot);
[[nodiscard]] std::string toPng(const Plot& plot);

}  // namespace esvr::report
