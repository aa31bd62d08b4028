#pragma once
/// How many bits each parameter of an ellipsoid has: integers alone, the same for who writes and
/// who reads (docs/format.md, "The lattice").

#include <algorithm>
#include <cstdint>

#include "esvr/quantised.h"

namespace esvr {

/// Scales of an ellipsoid in coarse steps: smallest, middle above it, largest above that.
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

/// The step of an intensity is the lattice's, halved so many times.
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
