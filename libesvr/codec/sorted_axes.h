#pragma once
/// One of the 24 ways in which a scale triple and a quaternion name the same ellipsoid.

#include <array>
#include <cstddef>

#include "esvr/ellipsoids.h"

namespace esvr {

struct SortedAxes {
  std::array<double, 3> logScale;  ///< decreasing
  std::array<double, 4> rotation;  ///< unit, w >= |x|, |y|, |z|
};

/// Axes by decreasing scale; of the quaternions that differ by half turns about the axes, which do
/// not change an ellipsoid, the one with the largest w: none of the others exceeds sqrt(1/2).
[[nodiscard]] SortedAxes sortedAxes(const Ellipsoids& e, std::size_t i);

}  // namespace esvr
