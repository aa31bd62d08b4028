#pragma once
/// The quantisation lattice of ellipsoids: the number of bits of each of their parameters. Only integers are used, so that
/// writer and reader get the same numbers (docs/format.md, "The quantisation lattice").
///
/// An error of a center matters less along a long axis of its ellipsoid than along a short one, and
/// an error of a rotation less about some axes than about others. The errors of the three
/// coordinates are therefore coupled by a covariance C: coordinate 0 may have the error sqrt(C_00);
/// the others then follow it, and may deviate by the square roots of their variances under the
/// condition of the coordinates before them. The product of these three is sqrt(det C), the least
/// possible one.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "esvr/ellipsoids.h"
#include "esvr/quantised.h"

namespace esvr {

/// The three smaller components of a unit quaternion lie within +-sqrt(1/2), an interval of this
/// length.
inline constexpr double kRotationSide = std::numbers::sqrt2;

inline constexpr std::size_t kEllipsoidsPerTask = 256;  ///< grain of TBB tasks

/// The scales of an ellipsoid in coarse steps: the low one, the middle one above the low one, and
/// the high one above the middle one.
struct CoarseScales {
  std::uint32_t low, middle, high;
};

/// Bits of the three coordinates of a center or of the three components of a rotation.
using AxisBits = std::array<int, 3>;

/// The components x, y and z of a rotation as in QuantisedEllipsoids.
using RotationCodes = std::array<std::uint16_t, 3>;

/// Every component of a rotation has this number of bits or fewer that come first. The number of
/// its other bits depends on them.
inline constexpr int kMaxCoarseRotationBits = 3;

inline int scaleBits(const Lattice& lattice, int precision) {
  return std::clamp(precision - lattice.scaleOffset, 0, Lattice::kMaxScaleBits);
}

/// The number of the coarse bits of a rotation's components.
[[nodiscard]] int coarseRotationBits(const Lattice& lattice, int precision, const CoarseScales& s);

/// \param rotation  codes of which only the coarse bits are used
[[nodiscard]] AxisBits rotationBits(const Lattice& lattice, int precision, const CoarseScales& s,
                                    const RotationCodes& rotation);

/// \param bits  the bits of the rotation's components
[[nodiscard]] AxisBits positionBits(const Lattice& lattice, int precision, const CoarseScales& s,
                                    const RotationCodes& rotation, const AxisBits& bits);

/// The number of times that the lattice's intensity step is halved for an ellipsoid.
inline int intensityShift(const Lattice& lattice, const CoarseScales& s) {
  const int volume = int(3 * s.low + 2 * s.middle + s.high);
  const int shift = (lattice.intensityBase + lattice.intensitySlope * volume) >> 8;
  return std::clamp(shift, 0, Lattice::kMaxIntensityShift);
}

/// The codes of the scales of ellipsoid i, the smallest scale first.
inline std::array<std::uint32_t, 3> scaleCodes(const QuantisedEllipsoids& q, std::size_t i) {
  return {q.scale[0][i], q.scale[1][i], q.scale[2][i]};
}

/// The coarse part of the codes of scales that have this number of finer bits.
inline CoarseScales coarseOf(const std::array<std::uint32_t, 3>& codes, int bits) {
  return {codes[0] >> bits, codes[1] >> bits, codes[2] >> bits};
}

/// The coarse scales of ellipsoid i.
inline CoarseScales coarseScales(const QuantisedEllipsoids& q, std::size_t i) {
  return coarseOf(scaleCodes(q, i), scaleBits(q.lattice, q.precision[i]));
}

inline RotationCodes rotationCodes(const QuantisedEllipsoids& q, std::size_t i) {
  return {q.rotation[0][i], q.rotation[1][i], q.rotation[2][i]};
}

/// The bits of ellipsoid i, whose scales and rotation are set.
struct ShapeBits {
  AxisBits rotation, position;
};
[[nodiscard]] ShapeBits shapeBits(const QuantisedEllipsoids& q, std::size_t i);

// ---- What quantise() rounds

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
