#pragma once
/// What quantise() rounds: one of the 24 combinations of scales and rotation that describe the same ellipsoid, and
/// coordinates whose errors are coupled, one after the other.

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

/// Rounds three coupled coordinates in the order 0, 1, 2. The error of the first ones moves the
/// targets of the others to where the weighted error of all three is smallest.
class CoupledErrors {
 public:
  /// \param covariance  C; the weighted error of a vector d is d^T C^-1 d
  explicit CoupledErrors(const std::array<std::array<double, 3>, 3>& covariance);

  /// Returns the number that is added to coordinate `a` before it is rounded.
  /// \param error  errors of the coordinates before it: rounded value less exact value
  [[nodiscard]] double shift(std::size_t a, const std::array<double, 3>& error) const;

 private:
  std::array<std::array<double, 3>, 3> covariance_;
  double last_[2] = {0.0, 0.0};  ///< shift of coordinate 2 for unit errors of coordinates 0 and 1
};

/// The covariance of a center, which is that of the ellipsoid.
[[nodiscard]] CoupledErrors centerErrors(const SortedAxes& axes);

/// The covariance of a rotation's components x, y and z. A turn about an axis weighs as much as it
/// moves the ends of the two other axes.
[[nodiscard]] CoupledErrors rotationErrors(const SortedAxes& axes);

}  // namespace esvr
