
#include "codec/code_values.h"
#include "codec/lattice_bits.h"
#include "core/parallel.h"
#include "esvr/quantised.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;

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
