#pragma once
/// Plots of curves, drawn by cairo as SVG and as PNG.

#include <string>
#include <vector>

namespace esvr::report {

struct Point {
  double x = 0.0, y = 0.0;
};

struct Series {
  std::string name;
  std::vector<Point> points;  ///< joined in their order; those that are not finite are passed over
};

struct Plot {
  std::string title{}, xLabel{}, yLabel{};
  bool logarithmicX = false, logarithmicY = false;
  std::vector<Series> series{};
  int width = 900, height = 560;  ///< pixels
};

/// \throws RuntimeFailure  cairo reports an error (the text is cairo's)
[[nodiscard]] std::string toSvg(const Plot& plot);
[[nodiscard]] std::string toPng(const Plot& plot);

}  // namespace esvr::report
