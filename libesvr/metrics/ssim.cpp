/// The 3D SSIM of two volumes, brick by brick. Windows that cover backgrounds only are counted, not
/// computed.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "field/ssim_window.h"
#include "metrics/brick_pairs.h"

namespace esvr {
namespace {

using metrics::Backgrounds;
using metrics::BrickPair;

/// Weighted moments of one window.
struct Moments {
  double meanA, meanB, varianceA, varianceB, covariance;
};

class SsimFormula {
 public:
  explicit SsimFormula(double peak) : c_(ssimConstants(peak)) {}

  [[nodiscard]] double operator()(const Moments& m) const {
    const double luminance =
        (2.0 * m.meanA * m.meanB + c_.c1) / (square(m.meanA) + square(m.meanB) + c_.c1);
    return luminance * (2.0 * m.covariance + c_.c2) / (m.varianceA + m.varianceB + c_.c2);
  }
  /// SSIM of a window that covers the backgrounds only; exactly 1 if they are equal.
  [[nodiscard]] double ofBackgrounds(const Backgrounds& b) const {
    return (*this)({b.reference, b.candidate, 0.0, 0.0, 0.0});
  }

 private:
  static double square(double v) { return v * v; }
  SsimConstants c_;
};

/// The data that all bricks of a comparison share.
struct SsimScene {
  std::span<const BrickPair> pairs;
  Box box;
  Backgrounds backgrounds;
  SsimFormula formula;
};

/// Computes the SSIM map of one brick at a time. It uses the differences from the backgrounds,
/// which are zero in empty space. Means are then shifted by the background; variances are
/// unchanged.
class SsimBrick {
 public:
  explicit SsimBrick(const SsimScene& scene) : scene_(scene) {}

  /// Sum of (SSIM - SSIM of empty space) over the brick's voxels in the box.
  double excess(Coord brick);

 private:
  /// Weights of the windows around a brick's voxels along one axis: less than 1 if the box clips
  /// the window.
  using AxisWeights = std::array<double, kBrickSide>;

  void gather(Coord brick);
  void gatherFrom(const BrickPair& pair, Coord brick);
  void sumWindows();
  [[nodiscard]] Moments momentsAt(int offset, double weight) const;
  [[nodiscard]] AxisWeights axisWeights(std::int64_t first, std::int64_t low,
                                        std::int64_t high) const;

  const SsimScene& scene_;
  SsimWindow window_;
  Box support_;  ///< halo coordinates that hold anything but background
  HaloValues a_{}, b_{};
  BrickSums sumA_{}, sumB_{}, sumAa_{}, sumBb_{}, sumAb_{};
};

void SsimBrick::gatherFrom(const BrickPair& pair, Coord brick) {
  const Coord shift =
      (pair.brick - brick) * kBrickSide + Coord{kSsimRadius, kSsimRadius, kSsimRadius};
  Box local = metrics::localBox(pair.brick, scene_.box);
  local.min = maxCoord(local.min, kWholeHalo.min - shift);
  local.max = minCoord(local.max, kWholeHalo.max - shift);
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) {
        const int from = voxelOffset({x, y, z});
        const double a = pair.referenceAt(from) - scene_.backgrounds.reference;
        const double b = pair.candidateAt(from) - scene_.backgrounds.candidate;
        if (a == 0.0 && b == 0.0) continue;
        const Coord at = Coord{x, y, z} + shift;
        const int to = haloOffset(at.x, at.y, at.z);
        a_[to] = a;
        b_[to] = b;
        support_.expand(at);
      }
}

void SsimBrick::gather(Coord brick) {
  a_.fill(0.0);
  b_.fill(0.0);
  support_ = Box{};
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const Coord place = brick + Coord{x, y, z};
        const auto it = std::lower_bound(
            scene_.pairs.begin(), scene_.pairs.end(), place,
            [](const BrickPair& pair, Coord wanted) { return pair.brick < wanted; });
        if (it != scene_.pairs.end() && it->brick == place) gatherFrom(*it, brick);
      }
}

void SsimBrick::sumWindows() {
  const SsimWindow::Extent extent{support_, windowsThatSee(support_)};
  window_.sum(a_, extent, sumA_);
  window_.sum(b_, extent, sumB_);
  window_.sumProducts(a_, a_, extent, sumAa_);
  window_.sumProducts(b_, b_, extent, sumBb_);
  window_.sumProducts(a_, b_, extent, sumAb_);
}

Moments SsimBrick::momentsAt(int offset, double weight) const {
  const double meanA = sumA_[offset] / weight, meanB = sumB_[offset] / weight;
  return {scene_.backgrounds.reference + meanA, scene_.backgrounds.candidate + meanB,
          sumAa_[offset] / weight - meanA * meanA, sumBb_[offset] / weight - meanB * meanB,
          sumAb_[offset] / weight - meanA * meanB};
}

SsimBrick::AxisWeights SsimBrick::axisWeights(std::int64_t first, std::int64_t low,
                                              std::int64_t high) const {
  AxisWeights weights;
  for (int i = 0; i < kBrickSide; ++i) weights[i] = window_.weightWithin(first + i, low, high);
  return weights;
}

double SsimBrick::excess(Coord brick) {
  gather(brick);
  if (support_.empty()) return 0.0;
  sumWindows();
  const Box& box = scene_.box;
  const Coord corner = brick * kBrickSide;
  const AxisWeights weightsX = axisWeights(corner.x, box.min.x, box.max.x);
  const AxisWeights weightsY = axisWeights(corner.y, box.min.y, box.max.y);
  const AxisWeights weightsZ = axisWeights(corner.z, box.min.z, box.max.z);
  const double empty = scene_.formula.ofBackgrounds(scene_.backgrounds);
  // The other windows cover background only, and their difference is exactly zero.
  const Box inBox = metrics::localBox(brick, box), reached = windowsThatSee(support_);
  const Box local{maxCoord(inBox.min, reached.min), minCoord(inBox.max, reached.max)};
  double sum = 0.0;
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) {
        const double weight = weightsX[x] * weightsY[y] * weightsZ[z];
        sum += scene_.formula(momentsAt(voxelOffset({x, y, z}), weight)) - empty;
      }
  return sum;
}

/// The bricks of the box whose windows may cover more than background.
std::vector<Coord> bricksToVisit(std::span<const BrickPair> pairs, const Box& box) {
  std::vector<Coord> bricks(pairs.size());
  std::transform(pairs.begin(), pairs.end(), bricks.begin(),
                 [](const BrickPair& pair) { return pair.brick; });
  std::vector<Coord> reached = dilateBricks(bricks);
  std::erase_if(reached, [&](Coord b) { return metrics::localBox(b, box).empty(); });
  return reached;
}

double sumExcess(std::span<const Coord> bricks, const SsimScene& scene) {
  using Range = tbb::blocked_range<std::size_t>;
  constexpr std::size_t kBricksPerTask = 16;
  return parallelDeterministicReduce(
      Range(0, bricks.size(), kBricksPerTask), 0.0,
      [&](const Range& range, double sum) {
        const auto work = std::make_unique<SsimBrick>(scene);  // too large for a worker's stack
        for (std::size_t i = range.begin(); i != range.end(); ++i) sum += work->excess(bricks[i]);
        return sum;
      },
      std::plus<>());
}

}  // namespace

double ssim3d(const SparseVolume& reference, const SparseVolume& candidate, const Box& box,
              double peak) {
  if (box.empty()) throw UsageError("SSIM needs a box that has a voxel");
  if (!(peak > 0.0) || !std::isfinite(peak))
    throw UsageError("SSIM needs a positive peak, not " + std::to_string(peak));
  const auto pairs = metrics::pairBricks(reference, candidate);
  const SsimScene scene{
      pairs, box, {reference.background, candidate.background}, SsimFormula(peak)};
  const double ssim = scene.formula.ofBackgrounds(scene.backgrounds) +
                      sumExcess(bricksToVisit(pairs, box), scene) / box.volume();
  if (!std::isfinite(ssim)) throw BadInput("SSIM needs finite values");
  return ssim;
}

}  // namespace esvr
