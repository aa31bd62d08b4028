#pragma once
/// The values that the codes of an ellipsoid stand for (docs/format.md, "The quantisation lattice").

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "codec/lattice_bits.h"
#include "core/rotation.h"

namespace esvr {

/// The middle of the interval that a code stands for, with 2^bits intervals in a unit.
inline double middleOfCode(double code, int bits) { return std::ldexp(code + 0.5, -bits); }

/// The logarithms of the scales, which decrease.
/// \param codes  as in QuantisedEllipsoids: the smallest scale first
/// \param bits   scaleBits() of the ellipsoid
inline std::array<double, 3> logScalesOf(const Lattice& lattice, int bits,
                                         const std::array<std::uint32_t, 3>& codes) {
  std::array<double, 3> logs{};
  double log = double(lattice.lowestScale);
  for (std::size_t a = 0; a < 3; ++a) {
    log += middleOfCode(codes[a], bits);
    logs[2 - a] = log * lattice.scaleStep;
  }
  return logs;
}

/// The rotation as a quaternion of unit length.
inline Quaternion quaternionOf(const RotationCodes& codes, const AxisBits& bits) {
  Quaternion r{1.0, 0.0, 0.0, 0.0};
  double norm2 = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const int unused = Lattice::kMaxRotationBits - bits[a];
    r[a + 1] = (middleOfCode(codes[a] >> unused, bits[a]) - 0.5) * kRotationSide;
    norm2 = norm2 + r[a + 1] * r[a + 1];
  }
  r[0] = std::sqrt(std::max(0.0, 1.0 - norm2));
  const double norm = std::sqrt(norm2 + r[0] * r[0]);
  for (double& c : r) c /= norm;
  return r;
}

}  // namespace esvr
