#include "field/coarser_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "field/brick_pairs.h"
#include "field/evaluate.h"

namespace esvr {

// Moments of kernels.

PlaceMoments momentsOf(const KernelConstants<double>& kernel) {
  // The integrals of phi r^2, phi r^4 and phi r^6 over the support, by the midpoint rule.
  constexpr int kParts = 128;
  const double part = supportRadius(kernel) / kParts;
  double mass = 0.0, second = 0.0, fourth = 0.0;
  for (int i = 0; i < kParts; ++i) {
    const double r = (i + 0.5) * part, square = r * r;
    const double phi = kernelPhi(kernel, square) * square * part;
    mass += phi, second += phi * square, fourth += phi * square * square;
  }
  return {mass, second / (3.0 * mass), 9.0 * fourth * mass / (second * second)};
}

namespace {

/// The kernels from which wider ones are chosen by their kurtosis, which falls as kappa rises.
class WiderKernels {
 public:
  explicit WiderKernels(const Kernel& kernel) {
    for (int n = 0; n <= kCount; ++n)
      moments_.push_back(momentsOf(kernelConstants<double>(kernel, kappaAt(n))));
  }

  struct Shape {
    double kappa;
    PlaceMoments moments;
  };
  /// The kernel of this kurtosis, or the nearest one.
  [[nodiscard]] Shape withKurtosis(double kurtosis) const {
    const auto above =
        std::ranges::lower_bound(moments_, kurtosis, std::greater<>(), &PlaceMoments::kurtosis);
    const auto n = std::clamp(above - moments_.begin(), std::ptrdiff_t{1}, std::ptrdiff_t{kCount});
    const PlaceMoments &a = moments_[std::size_t(n) - 1], &b = moments_[std::size_t(n)];
    const double apart = a.kurtosis - b.kurtosis;
    const double t = apart > 0.0 ? std::clamp((a.kurtosis - kurtosis) / apart, 0.0, 1.0) : 0.0;
    const auto between = [t](double from, double to) { return from + t * (to - from); };
    return {between(kappaAt(int(n) - 1), kappaAt(int(n))),
            {between(a.mass, b.mass), between(a.variance, b.variance), kurtosis}};
  }

 private:
  /// Beyond these, kernels are Gaussians and solid ellipsoids to 1 %.
  static constexpr double kSoftest = -8.0, kSharpest = 40.0;
  static constexpr int kCount = 192;
  static double kappaAt(int n) { return kSoftest + (kSharpest - kSoftest) * n / kCount; }

  std::vector<PlaceMoments> moments_;  ///< kCount + 1
};

// The filter.

/// The variance of the places of 2^level neighbouring voxels along an axis.
double filterVariance(int level) { return (std::exp2(2.0 * level) - 1.0) / 12.0; }

/// The kurtosis of a filtered kernel.
/// \param shares  by axis: the share of the variance that is the kernel's own
double filteredKurtosis(double kurtosis, const std::array<double, 3>& shares) {
  constexpr double kOfGaussian = 15.0, kExcessOfBox = -1.2;  // of the fourth moment along an axis
  double sum = 0.0, squares = 0.0, ofFilter = 0.0;
  for (const double share : shares) {
    sum += share, squares += share * share;
    ofFilter += kExcessOfBox * (1.0 - share) * (1.0 - share);
  }
  return kOfGaussian + (kurtosis / kOfGaussian - 1.0) * (sum * sum + 2.0 * squares) + ofFilter;
}

std::int32_t floorOf(double place) { return std::int32_t(std::floor(place)); }

/// An origin of coarser voxels near that of a chunk.
Coord originIn(Coord origin, double side) {
  return {floorOf(origin.x / side), floorOf(origin.y / side), floorOf(origin.z / side)};
}

/// Makes the ellipsoids of a field coarser, chunk by chunk.
class CoarserEllipsoids {
 public:
  CoarserEllipsoids(const Field& field, int level)
      : field_(field),
        shapes_(field.kernel),
        shared_(momentsOf(kernelConstants<double>(field.kernel))),
        side_(std::exp2(level)),
        filter_(filterVariance(level)) {}

  [[nodiscard]] Chunk of(const Chunk& from) const {
    const Ellipsoids& e = from.ellipsoids;
    Chunk to{originIn(from.origin, side_), e};
    to.ellipsoids.kappa.resize(e.size());
    parallelFor(std::size_t{0}, e.size(), [&](std::size_t i) {
      place(from, i, to);
      widen(e, i, to.ellipsoids);
    });
    return to;
  }

 private:
  void place(const Chunk& from, std::size_t i, Chunk& to) const {
    const double offset = 0.5 * (side_ - 1.0);
    const auto moved = [&](float center, std::int32_t origin, std::int32_t newOrigin) {
      return float((double(origin) + center - offset) / side_ - newOrigin);
    };
    const auto& [x, y, z] = from.ellipsoids.center;
    to.ellipsoids.center[0][i] = moved(x[i], from.origin.x, to.origin.x);
    to.ellipsoids.center[1][i] = moved(y[i], from.origin.y, to.origin.y);
    to.ellipsoids.center[2][i] = moved(z[i], from.origin.z, to.origin.z);
  }
  /// Adds the variance of the filter along each axis, and keeps the integral.
  void widen(const Ellipsoids& from, std::size_t i, Ellipsoids& to) const {
    const PlaceMoments own = from.kappa.empty()
                                 ? shared_
                                 : momentsOf(kernelConstants<double>(field_.kernel, from.kappa[i]));
    std::array<double, 3> scales, shares;
    for (std::size_t a = 0; a < 3; ++a) {
      scales[a] = std::exp(double(from.logScale[a][i]));
      const double variance = own.variance * scales[a] * scales[a];
      shares[a] = variance / (variance + filter_);
    }
    const auto shape = shapes_.withKurtosis(filteredKurtosis(own.kurtosis, shares));
    double kept = own.mass / shape.moments.mass;
    for (std::size_t a = 0; a < 3; ++a) {
      const double wider = std::sqrt(own.variance / shares[a] / shape.moments.variance);
      to.logScale[a][i] = float(std::log(scales[a] * wider / side_));
      kept /= wider;
    }
    to.intensity[i] = float(from.intensity[i] * kept);
    to.kappa[i] = float(shape.kappa);
  }

  const Field& field_;
  WiderKernels shapes_;
  PlaceMoments shared_;
  double side_, filter_;
};

}  // namespace

Field coarserField(const Field& field, int level) {
  Field coarser{field.background, field.kernel, {}};
  const CoarserEllipsoids ellipsoids(field, level);
  for (const Chunk& chunk : field.chunks) coarser.chunks.push_back(ellipsoids.of(chunk));
  return coarser;
}

// Its voxels.

namespace {

/// The range of the values if the rule names it, or else that of the intensities.
bool isOnOneSide(const Field& field, const std::optional<ValueRange>& range) {
  if (range) return range->min >= field.background || range->max <= field.background;
  bool anyAbove = false, anyBelow = false;
  for (const Chunk& chunk : field.chunks)
    for (const float intensity : chunk.ellipsoids.intensity)
      anyAbove |= intensity > 0.0f, anyBelow |= intensity < 0.0f;
  return !(anyAbove && anyBelow);
}

}  // namespace

bool hasCoarserFields(const Field& field, const RevoxeliseOptions& voxels) {
  return !voxels.restrictToBricks && !voxels.narrowBand && isOnOneSide(field, voxels.range);
}

RevoxeliseOptions coarserRule(const RevoxeliseOptions& voxels, int level) {
  RevoxeliseOptions coarser = voxels;
  // A mean of voxels of which some are below the threshold may be below it too. Divisors from 1 to 2^level
  // were tried: without one, thin tubes lose pieces, and with 2^level, faint space around objects stays
  // (docs/lab-notes.md). Beyond level 4, whole objects are smaller than a voxel, and would vanish.
  coarser.threshold =
      voxels.threshold * float(std::exp2(-0.5 * level - 1.5 * std::max(level - 4, 0)));
  const auto down = [level](Coord c) { return Coord{c.x >> level, c.y >> level, c.z >> level}; };
  coarser.box = {down(voxels.box.min), down(voxels.box.max)};
  coarser.alwaysActive = {};
  return coarser;
}

std::vector<Coord> coarserReach(const Field& coarser, const Box& within) {
  // A place where a finer level differs from the background lies within half a voxel of its support,
  // and the voxels around it within one more.
  constexpr double kAround = 1.5;
  const std::vector<Support> reach = supports(coarser, kAround);
  requireListable(reach, bricksOf(within));
  std::vector<Coord> bricks = missingBricks(
      BrickIndex({}), reach.size(), [&](std::size_t i) { return reach[i]; }, bricksOf(within));
  for (Coord& brick : bricks) brick = brick * kBrickSide;
  return bricks;
}

}  // namespace esvr
