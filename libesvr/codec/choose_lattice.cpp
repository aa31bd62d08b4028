#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "esvr/error.h"
#include "esvr/quantised.h"

namespace esvr {
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

class Chooser {
 public:
  Chooser(const Ellipsoids& e, const QuantiserSteps& steps, double lightest)
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
  choice.lattice = Chooser(e, allowed, lightest).choose(curvatureOfVolume(e, phi2));
  return choice;
}

}  // namespace esvr
