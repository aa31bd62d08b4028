// Reading the quantisation lattice: the numbers of bits of an ellipsoid, in integers, and the ellipsoids that codes
// stand for.

#include "codec/lattice.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/quantised.h"

namespace esvr {
namespace {

constexpr int kUnitLog2 = 8;  // numbers of bits are computed in units of 1/256

/// log2(v) in units of 1/256, interpolated linearly between powers of two.
int logOf(std::int64_t v) {
  const auto positive = std::uint64_t(std::max<std::int64_t>(v, 1));
  const int whole = int(std::bit_width(positive)) - 1;
  return (whole << kUnitLog2) + int(((positive << kUnitLog2) >> whole) & 255u);
}

/// log2(v / 2^one) in units of 1/256.
int logOf(std::int64_t v, int one) { return logOf(v) - (one << kUnitLog2); }

constexpr std::int64_t square(std::int64_t v) { return v * v; }

// ---- Rotations as fixed-point numbers

constexpr int kTurnOne = 29;  // log2 of the square of a quaternion of length 1

struct Turn {
  std::int64_t w, x, y, z;
};

/// The middle of the interval of a code, in units of sqrt(2) / 2^15.
std::int64_t middleOf(std::uint16_t code, int bits) {
  constexpr int kTop = Lattice::kMaxRotationBits;
  return 2 * std::int64_t(code) + (std::int64_t{1} << (kTop - bits)) - (std::int64_t{1} << kTop);
}

/// The largest integer whose square is at most v < 2^30. The square root of an integer is rounded
/// correctly, and that of a square is exact.
std::int64_t rootOf(std::int64_t v) { return std::int64_t(std::sqrt(double(v))); }

Turn turnOf(const RotationCodes& codes, const AxisBits& bits) {
  Turn t{0, middleOf(codes[0], bits[0]), middleOf(codes[1], bits[1]), middleOf(codes[2], bits[2])};
  const std::int64_t rest = (std::int64_t{1} << kTurnOne) - square(t.x) - square(t.y) - square(t.z);
  // w is the largest component and thus at least 1/2; coarse codes may say otherwise
  t.w = rootOf(std::max(rest, std::int64_t{1} << (kTurnOne - 2)));
  return t;
}

/// Rows 0 and 2 of the rotation matrix, in units of 2^-12.
struct OuterRows {
  static constexpr int kOne = 12;
  std::array<std::int64_t, 3> first, last;
};

OuterRows rowsOf(const Turn& t) {
  constexpr int kShift = kTurnOne - OuterRows::kOne;
  constexpr std::int64_t kOne = std::int64_t{1} << kTurnOne;
  OuterRows rows{{kOne - 2 * (square(t.y) + square(t.z)), 2 * (t.x * t.y - t.w * t.z),
                  2 * (t.x * t.z + t.w * t.y)},
                 {2 * (t.x * t.z - t.w * t.y), 2 * (t.y * t.z + t.w * t.x),
                  kOne - 2 * (square(t.x) + square(t.y))}};
  for (auto* row : {&rows.first, &rows.last})
    for (std::int64_t& m : *row) m >>= kShift;
  return rows;
}

// ---- Positions

constexpr int kMaxOctaves = 10;  // largest ratio of two scales, as a power of two, that counts

/// The ratio of the middle and the high scale to the low one, in units of 1/256 octave.
struct Ratios {
  int middle, high;
};

Ratios ratiosOf(const Lattice& lattice, const CoarseScales& s) {
  constexpr std::int64_t kMost = kMaxOctaves << kUnitLog2;
  const std::int64_t slope = lattice.positionSlope;
  // the scales differ by half a coarse step more, on average
  const auto octaves = [&](std::uint32_t steps) { return (slope * (2 * steps + 1)) >> 1; };
  const std::int64_t middle = std::clamp<std::int64_t>(octaves(s.middle), 0, kMost);
  return {int(middle), int(std::clamp<std::int64_t>(middle + octaves(s.high), middle, kMost))};
}

constexpr int kPowerOne = 8;  // log2 of powerOfFour(0)

/// 4^(e / 256), in units of 2^-8, with e rounded down to an eighth.
std::int64_t powerOfFour(int e) {
  constexpr std::array<std::int64_t, 4> kFractions{256, 304, 362, 431};  // 2^(8 + k / 4)
  const int twice = 2 * e;
  return kFractions[std::size_t((twice >> 6) & 3)] << (twice >> kUnitLog2);
}

int clampedPosition(const Lattice& lattice, int bits) {
  return std::clamp(bits >> kUnitLog2, 0, Lattice::kMaxPositionBits - lattice.cellBits);
}

// ---- Rotations

constexpr int kMaxTurnOctaves = 5;  // rotations about two axes differ by at most this in precision

int thresholdsUpTo(const Lattice& lattice, std::uint32_t ratio) {
  return int(std::count_if(lattice.rotationFrom.begin(), lattice.rotationFrom.end(),
                           [&](std::uint8_t from) { return ratio >= from; }));
}

/// Bits of a component if all of them need the precision of a turn about the middle axis, which
/// moves the ends of the longest axis towards the shortest one.
int isotropicBits(const Lattice& lattice, int precision, const CoarseScales& s) {
  const int bits = precision + lattice.rotationOffset + thresholdsUpTo(lattice, s.middle + s.high);
  return std::clamp(bits, 0, Lattice::kMaxRotationBits);
}

/// Octaves by which turns about the long and about the short axis may be coarser than those about
/// the middle one.
struct TurnOctaves {
  int aboutLong, aboutShort;
};

TurnOctaves turnOctaves(const Lattice& lattice, const CoarseScales& s) {
  const int all = thresholdsUpTo(lattice, s.middle + s.high);
  return {std::min(all - thresholdsUpTo(lattice, s.middle), kMaxTurnOctaves),
          std::min(all - thresholdsUpTo(lattice, s.high), kMaxTurnOctaves)};
}

/// The logarithms of C_00, of 1 / (C^-1)_22 and of det C for turns whose variances are powers of
/// four, in units of 1/256.
struct Variances {
  int first, last, all;
};

Variances turnVariances(const Turn& t, const TurnOctaves& octaves) {
  // A small turn by d about the ellipsoid's axes changes (x, y, z) by A d / 2, where
  // A = ((w, -z, y), (z, w, -x), (-y, x, w)).
  const std::int64_t first = (square(t.w) << (2 * octaves.aboutLong)) + square(t.z) +
                             (square(t.y) << (2 * octaves.aboutShort));
  // column 2 of w A^-1, in units of 2^-15
  constexpr int kShift = 14, kColumnOne = 2 * (kTurnOne - kShift);
  const std::int64_t column[] = {(t.x * t.z - t.w * t.y) >> kShift,
                                 (t.y * t.z + t.w * t.x) >> kShift,
                                 (square(t.w) + square(t.z)) >> kShift};
  const std::int64_t last = (square(column[0]) << (2 * (kMaxTurnOctaves - octaves.aboutLong))) +
                            (square(column[1]) << (2 * kMaxTurnOctaves)) +
                            (square(column[2]) << (2 * (kMaxTurnOctaves - octaves.aboutShort)));
  const int w2 = logOf(square(t.w), kTurnOne);
  return {logOf(first, kTurnOne), w2 - logOf(last, kColumnOne + 2 * kMaxTurnOctaves),
          w2 + ((2 * (octaves.aboutLong + octaves.aboutShort)) << kUnitLog2)};
}

}  // namespace

int coarseRotationBits(const Lattice& lattice, int precision, const CoarseScales& s) {
  return std::min(isotropicBits(lattice, precision, s), kMaxCoarseRotationBits);
}

AxisBits rotationBits(const Lattice& lattice, int precision, const CoarseScales& s,
                      const RotationCodes& rotation) {
  const int all = isotropicBits(lattice, precision, s);
  const int coarse = std::min(all, kMaxCoarseRotationBits);
  if (all == coarse) return {all, all, all};
  RotationCodes known = rotation;
  for (auto& code : known) {
    const int below = Lattice::kMaxRotationBits - coarse;
    code = std::uint16_t((code >> below) << below);
  }
  const Variances v =
      turnVariances(turnOf(known, {coarse, coarse, coarse}), turnOctaves(lattice, s));
  const auto bits = [&](int variance) {
    constexpr int kHalf = 1 << (kUnitLog2 - 1);
    const int wanted = ((all << kUnitLog2) - (variance >> 1) + kHalf) >> kUnitLog2;
    return std::clamp(wanted, coarse, Lattice::kMaxRotationBits);
  };
  return {bits(v.first), bits(v.all - v.first - v.last), bits(v.last)};
}

AxisBits positionBits(const Lattice& lattice, int precision, const CoarseScales& s,
                      const RotationCodes& rotation, const AxisBits& bits) {
  // bits if the ellipsoid were a ball of the low scale
  const int ball = 256 * precision + lattice.positionBase - lattice.positionSlope * int(s.low);
  const Ratios ratio = ratiosOf(lattice, s);
  const OuterRows rows = rowsOf(turnOf(rotation, bits));
  const int axes[] = {ratio.high, ratio.middle, 0};
  std::int64_t first = 0, last = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    first += powerOfFour(axes[k]) * square(rows.first[k]);
    last += powerOfFour(ratio.high - axes[k]) * square(rows.last[k]);
  }
  constexpr int kOne = kPowerOne + 2 * OuterRows::kOne;
  const int x = logOf(first, kOne) >> 1, z = ratio.high - (logOf(last, kOne) >> 1);
  const int y = ratio.middle + ratio.high - x - z;
  return {clampedPosition(lattice, ball - x), clampedPosition(lattice, ball - y),
          clampedPosition(lattice, ball - z)};
}

ShapeBits shapeBits(const QuantisedEllipsoids& q, std::size_t i) {
  const CoarseScales s = coarseScales(q, i);
  const RotationCodes codes = rotationCodes(q, i);
  const AxisBits rotation = rotationBits(q.lattice, q.precision[i], s, codes);
  return {rotation, positionBits(q.lattice, q.precision[i], s, codes, rotation)};
}

// ---- From codes to ellipsoids

namespace {

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
  using Range = tbb::blocked_range<std::size_t>;
  parallelFor(Range(0, q.size(), kEllipsoidsPerTask), [&](const Range& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) put(q, i, e);
  });
  return e;
}

}  // namespace esvr
