
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "codec/lattice_bits.h"
#include "core/parallel.h"
#include "core/rotation.h"
#include "esvr/quantised.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// The middle of the interval that a code stands for, with 2^bits intervals in a unit.
double middleOfCode(double code, int bits) { return std::ldexp(code + 0.5, -bits); }

/// The logarithms of the scales, which decrease.
/// \param codes  as in QuantisedEllipsoids: the smallest scale first
/// \param bits   scaleBits() of the ellipsoid
std::array<double, 3> logScalesOf(const Lattice& lattice, int bits,
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
Quaternion quaternionOf(const RotationCodes& codes, const AxisBits& bits) {
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

void putScales(const QuantisedEllipsoids& q, std::size_t i, Ellipsoids& e) {
  const auto logs = logScalesOf(q.lattice, scaleBits(q.lattice, q.precision[i]), scaleCodes(q, i));
  for (std::size_t a = 0; a < 3; ++a) e.logScale[a][i] = float(logs[a]);
}

void putCenter(const QuantisedEllipsoids& q, std::size_t i, const AxisBits& bits, Ellipsoids& e) {
  const Coord& low = q.lattice.lowestCell;
  const double lowest[] = {double(low.x), double(low.y), double(low.z)};
  for (std::size_t a = 0; a < 3; ++a)
    e.center[a][i] = float((lowest[a] + middleOfCode(q.position[a][i], bits[a])) * q.lattice.cell);
}

void putRotation(const QuantisedEllipsoids& q, std::size_t i, const AxisBits& bits, Ellipsoids& e) {
  const Quaternion r = quaternionOf(rotationCodes(q, i), bits);
  for (std::size_t a = 0; a < 4; ++a) e.rotation[a][i] = float(r[a]);
}

void putIntensity(const QuantisedEllipsoids& q, std::size_t i, int shift, Ellipsoids& e) {
  const std::int32_t code = q.intensity[i];
  const double magnitude =
      middleOfCode(code < 0 ? -1 - code : code, shift) * q.lattice.intensityStep;
  e.intensity[i] = float(code < 0 ? -magnitude : magnitude);
}

void put(const QuantisedEllipsoids& q, std::size_t i, Ellipsoids& e) {
  const ShapeBits bits = shapeBits(q, i);
  putScales(q, i, e);
  putCenter(q, i, bits.position, e);
  putRotation(q, i, bits.rotation, e);
  putIntensity(q, i, intensityShift(q.lattice, coarseScales(q, i)), e);
}

}  // namespace

void QuantisedEllipsoids::resize(std::size_t n) {
  for (auto& v : position) v.resize(n);
  precision.resize(n);
  for (auto& v : scale) v.resize(n);
  for (auto& v : rotation) v.resize(n);
  intensity.resize(n);
}

Ellipsoids dequantise(const QuantisedEllipsoids& q) {
  Ellipsoids e;
  e.resize(q.size());
  parallelFor(Range(0, q.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) put(q, i, e);
  });
  return e;
}

}  // namespace esvr
