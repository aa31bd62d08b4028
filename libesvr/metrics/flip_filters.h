#pragma once
/// FLIP's filters. All are products of a filter along x and one along y, or sums of such.

#include <vector>

namespace esvr::metrics {

/// Weights at the places -radius to radius.
using Taps = std::vector<double>;

/// One channel of a picture.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;
};

/// The plane under a filter of taps `x` along rows and `y` along columns; beyond the border, the
/// border's value goes on.
[[nodiscard]] Plane filtered(const Plane& plane, const Taps& x, const Taps& y);

/// A share of a sum of filters that are alike along both axes.
struct Blur {
  double share = 1.0;
  Taps taps;  ///< sum up to 1
};

/// How the eye blurs each opponent channel: Gaussians fitted to its contrast sensitivity.
struct EyeFilters {
  std::vector<Blur> achromatic, redGreen, blueYellow;
};
[[nodiscard]] EyeFilters eyeFilters(double pixelsPerDegree);

[[nodiscard]] Plane blurred(const Plane& plane, const std::vector<Blur>& blurs);

/// Derivatives of a Gaussian of the width of an edge that the eye detects. Weights of either sign
/// sum up to 1 and -1.
struct FeatureFilters {
  Taps edge, point, across;
};
[[nodiscard]] FeatureFilters featureFilters(double pixelsPerDegree);

}  // namespace esvr::metrics
