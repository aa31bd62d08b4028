#pragma once
/// Computes the number of bits of each parameter of an ellipsoid. Only integers are used, so that
/// writer and reader get the same numbers (docs/format.md, "The quantisation lattice").

#include <algorithm>
#include <cstdint>
#include <numbers>

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

inline int scaleBits(const Lattice& lattice, int precision) {
  return std::clamp(precision - lattice.scaleOffset, 0, Lattice::kMaxScaleBits);
}

inline int positionBits(const Lattice& lattice, int precision, const CoarseScales& s) {
  const int bits =
      (256 * precision + lattice.positionBase - lattice.positionSlope * int(s.low)) >> 8;
  return std::clamp(bits, 0, Lattice::kMaxPositionBits - lattice.cellBits);
}

inline int rotationBits(const Lattice& lattice, int precision, const CoarseScales& s) {
  const std::uint32_t ratio = s.middle + s.high;
  int bits = precision + lattice.rotationOffset;
  for (const auto from : lattice.rotationFrom) bits += ratio >= from ? 1 : 0;
  return std::clamp(bits, 0, Lattice::kMaxRotationBits);
}

/// The number of times that the lattice's intensity step is halved for an ellipsoid.
inline int intensityShift(const Lattice& lattice, const CoarseScales& s) {
  const int volume = int(3 * s.low + 2 * s.middle + s.high);
  const int shift = (lattice.intensityBase + lattice.intensitySlope * volume) >> 8;
  return std::clamp(shift, 0, Lattice::kMaxIntensityShift);
}

/// The coarse scales of ellipsoid i.
inline CoarseScales coarseScales(const QuantisedEllipsoids& q, std::size_t i) {
  const int bits = scaleBits(q.lattice, q.precision[i]);
  return {q.scale[0][i] >> bits, q.scale[1][i] >> bits, q.scale[2][i] >> bits};
}

}  // namespace esvr
