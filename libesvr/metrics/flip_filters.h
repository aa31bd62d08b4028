#pragma once
/// FLIP's filters. Each is a product of a filter along x and a filter along y, or a sum of these.

#include <vector>

namespace esvr::metrics {

/// Weights at the offsets -radius to radius.
using Taps = std::vector<double>;

/// One channel of a picture.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;
};

/// Filters a plane with the taps `x` along rows and `y` along columns. Outside the plane, the value
/// of the nearest border pixel is used.
[[nodiscard]] Plane filtered(const Plane& plane, const Taps& x, const Taps& y);

/// A term of a sum of filters, with the same taps along both axes.
struct Blur {
  double share = 1.0;
  Taps taps;  ///< sum up to 1
};

/// The blur of each opponent channel: Gaussians fitted to the contrast sensitivity of the eye.
struct EyeFilters {
  std::vector<Blur> achromatic, redGreen, blueYellow;
};
[[nodiscard]] EyeFilters eyeFilters(double pixelsPerDegree);

[[nodiscard]] Plane blurred(const Plane& plane, const std::vector<Blur>& blurs);

/// Derivatives of a Gaussian that has the width of an edge that the eye detects. The positive
/// weights have the sum 1, the negative ones the sum -1.
struct FeatureFilters {
  Taps edge, point, across;
};
[[nodiscard]] FeatureFilters featureFilters(double pixelsPerDegree);

}  // namespace esvr::metrics
