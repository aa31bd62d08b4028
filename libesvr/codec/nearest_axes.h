#pragma once
/// The exact shape of an ellipsoid for comparison with shapes on a lattice.

#include <array>
#include <cstddef>

#include "codec/sorted_axes.h"
#include "core/rotation.h"

namespace esvr {

class NearestAxes {
 public:
  /// Of the rotations that describe the ellipsoid with decreasing scales, takes the one that is
  /// nearest to `before` and whose components x, y and z have codes.
  NearestAxes(const Ellipsoids& e, std::size_t i, const Quaternion& before);

  [[nodiscard]] const SortedAxes& axes() const { return axes_; }

  /// The logarithms of the scales that fit the ellipsoid best along the axes of another rotation.
  /// They decrease: a scale that would be larger than the one before is the same.
  [[nodiscard]] std::array<double, 3> logScalesAlong(const Quaternion& rotation) const;

  /// The squared distance of a shape: the sum of the squared errors of the logarithms of the scales,
  /// if only these are wrong. For small errors it is proportional to the squared error of the field.
  [[nodiscard]] double squaredError(const std::array<double, 3>& logScale,
                                    const Quaternion& rotation) const;

 private:
  [[nodiscard]] Matrix3 covarianceAlong(const Quaternion& rotation) const;

  SortedAxes axes_;
};

}  // namespace esvr
