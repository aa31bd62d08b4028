// Quantising ellipsoids: the lattice whose steps cost the same squared error in every parameter, one description of
// each ellipsoid, and the codes of its parameters, in the order of the file.

#include "codec/lattice.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <numbers>
#include <string>
#include <utility>

#include "codec/brick_coder.h"
#include "core/geometry.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr {

// ---- The lattice, the precisions and the layers

namespace {

// How the squared error grows, for a Gaussian of weight w (sums over its voxels):
// intensity w^2 (dI / I)^2, scale 3/4 w^2 (d log s)^2, position w^2 (d / s)^2,
// quaternion w^2 (s1 / s3 - s3 / s1)^2 dq^2.
constexpr double kScaleCurvature = 0.75;

constexpr double kCoarsestScale = 0.5;  // the estimates above hold for small changes only
constexpr double kFixed = 256.0;        // Lattice stores numbers of bits in units of 1/256
constexpr std::size_t kMaxThresholds = 16;
constexpr int kLastRatio = 255;

constexpr std::size_t kMinLayered = 2048;  // ellipsoids; layers of fewer cost too many bytes
constexpr std::size_t kFirstLayers = 8;    // the first layer has at least an eighth of all

/// Limits of the steps relative to the largest weight. Finer steps are below the precision of
/// float32, and coarser steps round everything away.
constexpr double kFinestStep = 0x1p-20, kCoarsestStep = 1.0;

QuantiserSteps within(const QuantiserSteps& steps, double low, double high) {
  return {std::clamp(steps.position, low, high), std::clamp(steps.scale, low, high),
          std::clamp(steps.rotation, low, high), std::clamp(steps.intensity, low, high)};
}

double volumeLog(const Ellipsoids& e, std::size_t i) {
  return double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i];
}

/// The median over the ellipsoids of sum phi^2 divided by the product of the scales.
double curvatureOfVolume(const Ellipsoids& e, std::span<const double> phi2) {
  std::vector<double> ratio(e.size());
  for (std::size_t i = 0; i < e.size(); ++i) ratio[i] = phi2[i] / std::exp(volumeLog(e, i));
  const auto middle = ratio.begin() + std::ptrdiff_t(ratio.size() / 2);
  std::nth_element(ratio.begin(), middle, ratio.end());
  return *middle > 0.0 ? *middle : 1.0;
}

std::vector<double> weightsOf(const Ellipsoids& e, std::span<const double> phi2) {
  std::vector<double> w(e.size());
  for (std::size_t i = 0; i < e.size(); ++i)
    w[i] = std::abs(double(e.intensity[i])) * std::sqrt(phi2[i]);
  return w;
}

/// The precision of each ellipsoid. Each precision stands for an octave of the weight, and the
/// highest one has the largest weight.
std::vector<std::uint8_t> precisionsOf(const std::vector<double>& weights, double largest) {
  std::vector<std::uint8_t> e(weights.size());
  for (std::size_t i = 0; i < e.size(); ++i) {
    const double octave = std::floor(std::log2(weights[i] / largest)) + 1 + Lattice::kMaxPrecision;
    e[i] = std::uint8_t(std::clamp(octave, 0.0, double(Lattice::kMaxPrecision)));
  }
  return e;
}

std::vector<std::uint8_t> layersOf(std::span<const std::uint8_t> precision) {
  std::array<std::size_t, Lattice::kMaxPrecision + 1> counts{};
  for (const auto e : precision) ++counts[e];
  std::vector<std::uint8_t> from;
  if (precision.size() < kMinLayered) return from;
  std::size_t above = 0, layers = kFirstLayers;
  for (std::size_t e = Lattice::kMaxPrecision; e > 0 && layers > 1; --e) {
    above += counts[e];
    if (above == precision.size()) break;
    if (above * layers < precision.size()) continue;
    from.push_back(std::uint8_t(e));
    while (above * layers >= precision.size()) layers /= 2;
  }
  return from;
}

class LatticeChooser {
 public:
  LatticeChooser(const Ellipsoids& e, const QuantiserSteps& steps, double lightest)
      : e_(e), steps_(steps), lightest_(lightest) {}

  Lattice choose(double curvatureOfVolume) {
    chooseScales();
    choosePositions();
    chooseRotations();
    chooseIntensities(curvatureOfVolume);
    return lattice_;
  }

 private:
  void chooseScales() {
    const double step = steps_.scale / (std::sqrt(kScaleCurvature) * lightest_);
    lattice_.scaleOffset = int(std::ceil(std::log2(step / kCoarsestScale)));
    lattice_.scaleStep = std::ldexp(step, -lattice_.scaleOffset);
    double lowest = HUGE_VAL;
    for (const auto& plane : e_.logScale)
      for (const float s : plane) lowest = std::min(lowest, double(s));
    lattice_.lowestScale = std::int32_t(std::floor(lowest / lattice_.scaleStep));
    lowestLog_ = (lattice_.lowestScale + 0.5) * lattice_.scaleStep;
  }

  void choosePositions() {
    lattice_.cell = 1.0;
    double low[3], span = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto [min, max] = std::minmax_element(e_.center[a].begin(), e_.center[a].end());
      low[a] = std::floor(*min / lattice_.cell);
      span = std::max(span, std::floor(*max / lattice_.cell) - low[a]);
    }
    if (!(span < std::ldexp(1.0, Lattice::kMaxCellBits)))
      throw RuntimeFailure("cannot quantise: the centers lie too far apart");
    lattice_.lowestCell = {std::int32_t(low[0]), std::int32_t(low[1]), std::int32_t(low[2])};
    while (span >= std::ldexp(1.0, lattice_.cellBits)) ++lattice_.cellBits;
    const double bits =
        std::log2(lattice_.cell * lightest_ / steps_.position) - lowestLog_ * std::numbers::log2e;
    lattice_.positionBase = int(std::lround(kFixed * (bits + 0.5)));
    lattice_.positionSlope = int(std::lround(kFixed * lattice_.scaleStep * std::numbers::log2e));
  }

  /// Number of bits of a rotation component at precision 0, if the coarse steps of the largest and
  /// the smallest scale differ by `ratio`. The scales themselves differ by a number of steps in
  /// [ratio, ratio + 2), because two differences were rounded down.
  [[nodiscard]] int rotationBitsAt(int ratio) const {
    const double log = (ratio + 0.75) * lattice_.scaleStep;
    const double step = steps_.rotation / (lightest_ * 2.0 * std::sinh(log));
    return int(std::lround(std::log2(std::numbers::sqrt2 / step)));
  }

  void chooseRotations() {
    lattice_.rotationOffset = rotationBitsAt(0);
    int bits = lattice_.rotationOffset;
    for (int ratio = 1; ratio <= kLastRatio; ++ratio)
      for (; bits < rotationBitsAt(ratio) && lattice_.rotationFrom.size() < kMaxThresholds; ++bits)
        lattice_.rotationFrom.push_back(std::uint8_t(ratio));
  }

  void chooseIntensities(double curvatureOfVolume) {
    // Logarithm of the product of the scales at code 0: three times the lowest scale, and half a
    // step for each difference.
    const double log = 3.0 * lowestLog_ + 1.5 * lattice_.scaleStep;
    lattice_.intensityStep = steps_.intensity / std::sqrt(curvatureOfVolume * std::exp(log));
    lattice_.intensitySlope =
        int(std::lround(kFixed * 0.5 * lattice_.scaleStep * std::numbers::log2e));
    lattice_.intensityBase = int(kFixed / 2);
    lattice_.signedIntensity = std::any_of(e_.intensity.begin(), e_.intensity.end(),
                                           [](float intensity) { return intensity < 0.0f; });
  }

  const Ellipsoids& e_;
  QuantiserSteps steps_;
  double lightest_;  ///< the weight in the middle of the octave of precision 0
  double lowestLog_ = 0.0;
  Lattice lattice_;
};

}  // namespace

LatticeChoice chooseLattice(const Ellipsoids& e, std::span<const double> phi2,
                            const QuantiserSteps& steps) {
  LatticeChoice choice;
  if (e.size() == 0) return choice;
  const auto weights = weightsOf(e, phi2);
  double largest = *std::max_element(weights.begin(), weights.end());
  if (!(largest > 0.0)) largest = 1.0;
  choice.precision = precisionsOf(weights, largest);
  choice.layerFrom = layersOf(choice.precision);
  const double lightest = std::ldexp(largest, -Lattice::kMaxPrecision - 1) * std::numbers::sqrt2;
  const auto allowed = within(steps, kFinestStep * largest, kCoarsestStep * largest);
  choice.lattice = LatticeChooser(e, allowed, lightest).choose(curvatureOfVolume(e, phi2));
  return choice;
}

// ---- One description of each ellipsoid

namespace {

using Quaternion = std::array<double, 4>;

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// Exchanges two neighbouring axes by a quarter turn about the third.
void exchange(SortedAxes& axes, std::size_t first) {
  const double h = std::sqrt(0.5);
  const Quaternion quarter = first == 0 ? Quaternion{h, 0, 0, h} : Quaternion{h, h, 0, 0};
  std::swap(axes.logScale[first], axes.logScale[first + 1]);
  axes.rotation = product(axes.rotation, quarter);
}

void takeLargestW(Quaternion& q) {
  constexpr Quaternion kHalfTurns[] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  Quaternion best = q;
  for (const Quaternion& turn : kHalfTurns)
    if (const auto turned = product(q, turn); std::abs(turned[0]) > std::abs(best[0]))
      best = turned;
  const double sign = best[0] < 0.0 ? -1.0 : 1.0;
  for (double& c : best) c *= sign;
  q = best;
}

}  // namespace

SortedAxes sortedAxes(const Ellipsoids& e, std::size_t i) {
  SortedAxes axes{{e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]},
                  {e.rotation[0][i], e.rotation[1][i], e.rotation[2][i], e.rotation[3][i]}};
  if (axes.logScale[0] < axes.logScale[1]) exchange(axes, 0);
  if (axes.logScale[1] < axes.logScale[2]) exchange(axes, 1);
  if (axes.logScale[0] < axes.logScale[1]) exchange(axes, 0);
  takeLargestW(axes.rotation);
  return axes;
}

// ---- Coupled errors

namespace {

using Covariance = std::array<std::array<double, 3>, 3>;

/// Smallest weight of a turn about one axis, relative to the largest one. A ball may turn freely.
constexpr double kMinTurn = 1.0 / 32.0;

/// M diag(variance) M^T.
Covariance covarianceOf(const Matrix3& m, const std::array<double, 3>& variance) {
  Covariance c{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      for (std::size_t k = 0; k < 3; ++k)
        c[row][column] += m[3 * row + k] * variance[k] * m[3 * column + k];
  return c;
}

/// The squared error that a small turn causes which mixes two axes, relative to its angle squared
/// and to the ellipsoid's weight.
double turnWeight(double logA, double logB) {
  const double root = 2.0 * std::sinh(std::abs(logA - logB));
  return root * root;
}

}  // namespace

CoupledErrors::CoupledErrors(const Covariance& covariance) : covariance_(covariance) {
  const auto& c = covariance_;
  const double determinant = c[0][0] * c[1][1] - c[0][1] * c[0][1];
  if (!(determinant > 0.0)) return;  // one coordinate follows the other: there is nothing to gain
  last_[0] = (c[0][2] * c[1][1] - c[1][2] * c[0][1]) / determinant;
  last_[1] = (c[1][2] * c[0][0] - c[0][2] * c[0][1]) / determinant;
}

double CoupledErrors::shift(std::size_t a, const std::array<double, 3>& error) const {
  if (a == 0) return 0.0;
  if (a == 1) return covariance_[0][1] / covariance_[0][0] * error[0];
  return last_[0] * error[0] + last_[1] * error[1];
}

CoupledErrors centerErrors(const SortedAxes& axes) {
  std::array<double, 3> variance{};
  for (std::size_t k = 0; k < 3; ++k)
    variance[k] = std::exp(2.0 * (axes.logScale[k] - axes.logScale[2]));
  return CoupledErrors(covarianceOf(rotationOf(axes.rotation), variance));
}

CoupledErrors rotationErrors(const SortedAxes& axes) {
  const auto [w, x, y, z] = axes.rotation;
  const auto& log = axes.logScale;
  const double largest = std::max(turnWeight(log[0], log[2]), 1e-300);
  std::array<double, 3> variance{};
  const double weights[] = {turnWeight(log[1], log[2]), largest, turnWeight(log[0], log[1])};
  for (std::size_t k = 0; k < 3; ++k)
    variance[k] = 1.0 / std::max(weights[k] / largest, kMinTurn * kMinTurn);
  // A small turn by d about the ellipsoid's axes changes (x, y, z) by M d / 2.
  return CoupledErrors(covarianceOf({w, -z, y, z, w, -x, -y, x, w}, variance));
}

// ---- The codes of ellipsoids

namespace {

using Indices = tbb::blocked_range<std::size_t>;

/// The code of a value in coarse steps, each of which is divided into 2^bits codes.
/// \throws RuntimeFailure  the value has no code
std::uint32_t codeOf(double steps, int bits, std::uint32_t lastCoarse, const char* what) {
  const double code = std::floor(std::ldexp(std::max(steps, 0.0), bits));
  if (!(code < std::ldexp(double(lastCoarse) + 1.0, bits)))
    throw RuntimeFailure(std::string("cannot quantise: ") + what + " lies outside the lattice");
  return std::uint32_t(code);
}

/// Codes the scales. Each logarithm is coded as the difference from the decoded value of the next
/// smaller scale, so that rounding errors do not add up.
void putScales(const std::array<double, 3>& logScale, std::size_t i, QuantisedEllipsoids& q) {
  const int bits = scaleBits(q.lattice, q.precision[i]);
  double below = double(q.lattice.lowestScale);
  for (std::size_t a = 0; a < 3; ++a) {
    const double steps = logScale[2 - a] / q.lattice.scaleStep;
    q.scale[a][i] = codeOf(steps - below, bits, Lattice::kMaxCoarseScale, "a scale");
    below += std::ldexp(double(q.scale[a][i]) + 0.5, -bits);
  }
}

std::array<double, 3> cellsOf(const Ellipsoids& e, std::size_t i, const Lattice& lattice) {
  const Coord& low = lattice.lowestCell;
  return {e.center[0][i] / lattice.cell - low.x, e.center[1][i] / lattice.cell - low.y,
          e.center[2][i] / lattice.cell - low.z};
}

/// Rounds the coordinates one after the other (CoupledErrors).
void putCenter(const std::array<double, 3>& cells, const CoupledErrors& errors,
               const AxisBits& bits, std::size_t i, QuantisedEllipsoids& q) {
  const std::uint32_t lastCell = (1u << q.lattice.cellBits) - 1;
  std::array<double, 3> error{};
  for (std::size_t a = 0; a < 3; ++a) {
    (void)codeOf(cells[a], bits[a], lastCell, "a center");
    const double last = std::ldexp(double(lastCell) + 1.0, bits[a]) - 1.0;
    const double code = std::floor(std::ldexp(cells[a] + errors.shift(a, error), bits[a]));
    q.position[a][i] = std::uint32_t(std::clamp(code, 0.0, last));
    error[a] = std::ldexp(double(q.position[a][i]) + 0.5, -bits[a]) - cells[a];
  }
}

/// The code of a rotation's component without limits, in units of the last bit.
double rotationCode(double component) {
  return std::ldexp(component / kRotationSide + 0.5, Lattice::kMaxRotationBits);
}

/// Sets the coarse bits of a rotation; the others are 0.
void putCoarseRotation(const SortedAxes& axes, std::size_t i, int bits, QuantisedEllipsoids& q) {
  const double step = std::ldexp(1.0, Lattice::kMaxRotationBits - bits);
  const double last = std::ldexp(1.0, bits) - 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double code = std::floor(rotationCode(axes.rotation[a + 1]) / step);
    q.rotation[a][i] = std::uint16_t(std::clamp(code, 0.0, last) * step);
  }
}

/// Rounds the components one after the other (CoupledErrors). Their coarse bits remain.
void putRotation(const SortedAxes& axes, std::size_t i, QuantisedEllipsoids& q) {
  const CoarseScales s = coarseScales(q, i);
  const int coarse = coarseRotationBits(q.lattice, q.precision[i], s);
  putCoarseRotation(axes, i, coarse, q);
  const AxisBits bits = rotationBits(q.lattice, q.precision[i], s, rotationCodes(q, i));
  const CoupledErrors errors = rotationErrors(axes);
  std::array<double, 3> error{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double step = std::ldexp(1.0, Lattice::kMaxRotationBits - bits[a]);
    const double first = double(q.rotation[a][i]) / step;
    const double last = first + std::ldexp(1.0, bits[a] - coarse) - 1.0;
    const double exact = rotationCode(axes.rotation[a + 1]);
    const double code = std::floor((exact + errors.shift(a, error)) / step);
    q.rotation[a][i] = std::uint16_t(std::clamp(code, first, last) * step);
    error[a] = double(q.rotation[a][i]) + 0.5 * step - exact;
  }
}

void putIntensity(double intensity, std::size_t i, QuantisedEllipsoids& q) {
  const int shift = intensityShift(q.lattice, coarseScales(q, i));
  const bool negative = q.lattice.signedIntensity && intensity < 0.0;
  const double magnitude =
      (negative || intensity > 0.0 ? std::abs(intensity) : 0.0) / q.lattice.intensityStep;
  const double code = std::floor(std::ldexp(magnitude, shift));
  const auto clamped = std::int32_t(std::min(code, double(Lattice::kMaxIntensity)));
  q.intensity[i] = negative ? -1 - clamped : clamped;
}

/// Quantises ellipsoid i, whose precision is already set.
void put(const Ellipsoids& e, std::size_t i, QuantisedEllipsoids& q) {
  const SortedAxes axes = sortedAxes(e, i);
  putScales(axes.logScale, i, q);
  putRotation(axes, i, q);
  putCenter(cellsOf(e, i, q.lattice), centerErrors(axes), shapeBits(q, i).position, i, q);
  putIntensity(e.intensity[i], i, q);
}

// ---- Their order in the file

std::uint64_t keyOf(const QuantisedEllipsoids& q, std::size_t i) {
  const AxisBits bits = shapeBits(q, i).position;
  std::uint64_t key = 0;
  for (std::size_t a = 0; a < 3; ++a) key |= spreadBits(q.position[a][i] >> bits[a]) << a;
  return key;
}

/// The number of an ellipsoid's layer, counted from the layer of the largest weights.
std::size_t layerOf(const LatticeChoice& choice, std::size_t i) {
  return std::size_t(std::count_if(choice.layerFrom.begin(), choice.layerFrom.end(),
                                   [&](auto from) { return choice.precision[i] < from; }));
}

std::vector<std::size_t> fileOrder(const QuantisedEllipsoids& q, const LatticeChoice& choice) {
  struct Place {
    std::size_t layer;
    std::uint64_t key;
    std::size_t ellipsoid;  // decides between equal keys
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> places(q.size());
  parallelFor(Indices(0, q.size(), kEllipsoidsPerTask), [&](const Indices& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      places[i] = {layerOf(choice, i), keyOf(q, i), i};
  });
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::size_t> order(q.size());
  for (std::size_t i = 0; i < q.size(); ++i) order[i] = places[i].ellipsoid;
  return order;
}

/// \param order  the ellipsoids in their new order, layer by layer
std::vector<std::size_t> layerEnds(const LatticeChoice& choice,
                                   const std::vector<std::size_t>& order) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i < order.size(); ++i)
    if (layerOf(choice, order[i]) != layerOf(choice, order[i - 1])) ends.push_back(i);
  if (!ends.empty()) ends.push_back(order.size());
  return ends;
}

template <class T>
void permute(const std::vector<std::size_t>& order, std::vector<T>& values) {
  std::vector<T> permuted(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) permuted[i] = values[order[i]];
  values = std::move(permuted);
}

void permute(const std::vector<std::size_t>& order, QuantisedEllipsoids& q) {
  for (auto* planes : {&q.position, &q.scale})
    for (auto& plane : *planes) permute(order, plane);
  for (auto& plane : q.rotation) permute(order, plane);
  permute(order, q.precision);
  permute(order, q.intensity);
}

}  // namespace

QuantisedEllipsoids quantise(const Ellipsoids& e, const LatticeChoice& choice,
                             std::vector<std::size_t>& order) {
  QuantisedEllipsoids q;
  q.lattice = choice.lattice;
  q.resize(e.size());
  q.precision = choice.precision;
  parallelFor(Indices(0, e.size(), kEllipsoidsPerTask), [&](const Indices& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) put(e, i, q);
  });
  order = fileOrder(q, choice);
  q.layerEnds = layerEnds(choice, order);
  permute(order, q);
  return q;
}

void quantiseIntensities(std::span<const float> intensities, QuantisedEllipsoids& q) {
  parallelFor(Indices(0, q.size(), kEllipsoidsPerTask), [&](const Indices& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) putIntensity(intensities[i], i, q);
  });
}

}  // namespace esvr
