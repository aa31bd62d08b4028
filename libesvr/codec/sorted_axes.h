#pragma once
/// Chooses one of the 24 combinations of scales and rotation that describe the same ellipsoid.

#include <array>
#include <cstddef>

#include "esvr/ellipsoids.h"

namespace esvr {

struct SortedAxes {
  std::array<double, 3> logScale;  ///< decreasing
  std::array<double, 4> rotation;  ///< unit quaternion w, x, y, z with w >= |x|, |y|, |z|
};

/// Sorts the axes by decreasing scale. Half turns about the axes do not change an ellipsoid; of the
/// quaternions that they lead to, the one whose w is the largest component is taken. Its other
/// components are at most sqrt(1/2) in magnitude.
[[nodiscard]] SortedAxes sortedAxes(const Ellipsoids& e, std::size_t i);

}  // namespace esvr
