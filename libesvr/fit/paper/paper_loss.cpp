#include "fit/paper/paper_loss.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "core/parallel.h"
#include "esvr/error.h"
#include "field/brick_halo.h"
#include "field/dilate_bricks.h"
#include "fit/paper/ssim_gradient.h"

namespace esvr {
namespace {

using Range = tbb::blocked_range<std::size_t>;
constexpr std::size_t kBricksPerTask = 8;

void check(const PaperLossInput& in) {
  if (!(in.beta >= 0.0 && in.beta <= 1.0))
    throw UsageError("the share of L1 in the loss must lie in 0 to 1, not be " +
                     std::to_string(in.beta));
  if (!(in.peak > 0.0) || !std::isfinite(in.peak))
    throw UsageError("the loss needs a positive peak, not " + std::to_string(in.peak));
  if (!(in.voxels > 0.0) || !std::isfinite(in.voxels))
    throw UsageError("the loss is a mean over voxels, not over " + std::to_string(in.voxels));
  if (in.residual.size() != in.index.size() * kBrickVoxels || in.target.size() % kBrickVoxels ||
      in.target.size() > in.residual.size())
    throw std::logic_error("residual or target do not fit the bricks");
}

/// All bricks with a window that overlaps a brick of the index, in increasing order.
std::vector<Coord> dilated(const BrickIndex& index) {
  std::vector<Coord> bricks = index.bricks();
  std::sort(bricks.begin(), bricks.end());
  return dilateBricks(bricks);
}

/// Drops empty boxes and their bricks.
void keepNonEmpty(std::vector<Coord>& bricks, std::vector<Box>& boxes) {
  std::size_t kept = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    if (boxes[b].empty()) continue;
    bricks[kept] = bricks[b];
    boxes[kept++] = boxes[b];
  }
  bricks.resize(kept);
  boxes.resize(kept);
}

/// The voxels whose windows overlap a support, extended to whole rows along z.
Box rowsThatSee(const Box& support) {
  Box voxels = windowsThatSee(support);
  voxels.min.z = kWholeBrick.min.z;
  voxels.max.z = kWholeBrick.max.z;
  return voxels;
}

template <class Visit>
void forEachBrick(std::size_t count, Visit&& visit) {
  parallelFor(Range(0, count, kBricksPerTask), [&](const Range& range) {
    for (std::size_t b = range.begin(); b != range.end(); ++b) visit(b);
  });
}

double sign(float v) { return double((v > 0.0f) - (v < 0.0f)); }

}  // namespace

double PaperLoss::sumOfBricks() const {
  // a sequential sum, whose rounding does not change if bricks of zeros are added
  return std::accumulate(brickSums_.begin(), brickSums_.end(), 0.0);
}

double PaperLoss::absoluteError(const PaperLossInput& in, std::vector<float>& lossByValue) {
  const double scale = in.beta / (in.voxels * in.peak);
  lossByValue.resize(in.residual.size());
  brickSums_.resize(in.index.size());
  forEachBrick(in.index.size(), [&](std::size_t b) {
    double sum = 0.0;
    for (std::size_t v = b * kBrickVoxels; v < (b + 1) * kBrickVoxels; ++v) {
      sum += std::abs(double(in.residual[v]));
      lossByValue[v] = float(scale * sign(in.residual[v]));
    }
    brickSums_[b] = sum;
  });
  return scale * sumOfBricks();
}

void PaperLoss::findWindows(const SsimValues& values, const std::optional<Box>& within) {
  nonZero_.resize(values.index.size());
  forEachBrick(nonZero_.size(), [&](std::size_t b) { nonZero_[b] = nonZeroBox(values, b); });

  std::vector<Coord> bricks = dilated(values.index);
  if (within) std::erase_if(bricks, [&](Coord b) { return !within->contains(b); });
  std::vector<Box> supports(bricks.size());
  forEachBrick(bricks.size(), [&](std::size_t b) {
    supports[b] = haloSupport(bricksAround(values.index, bricks[b]), nonZero_);
  });
  keepNonEmpty(bricks, supports);

  windows_.reached.resize(supports.size());
  std::transform(supports.begin(), supports.end(), windows_.reached.begin(), rowsThatSee);
  windows_.supports = std::move(supports);
  windows_.index = BrickIndex(bricks);
}

double PaperLoss::dissimilarities(const SsimValues& values) {
  const std::vector<Coord>& bricks = windows_.index.bricks();
  windows_.gradients.resize(bricks.size());
  brickSums_.resize(bricks.size());
  tbb::enumerable_thread_specific<WindowSide> work;
  forEachBrick(bricks.size(), [&](std::size_t b) {
    brickSums_[b] = work.local().evaluate(
        values, bricks[b], {windows_.supports[b], windows_.reached[b]}, windows_.gradients[b]);
  });
  return sumOfBricks();
}

void PaperLoss::addGradient(const SsimValues& values, double scale,
                            std::vector<float>& lossByValue) {
  tbb::enumerable_thread_specific<ValueSide> work;
  forEachBrick(values.index.size(), [&](std::size_t b) {
    const BrickSums& byValue = work.local().evaluate(values, b, nonZero_[b], windows_);
    float* out = &lossByValue[b * kBrickVoxels];
    for (int v = 0; v < kBrickVoxels; ++v) out[v] = float(double(out[v]) + scale * byValue[v]);
  });
}

double PaperLoss::evaluate(const PaperLossInput& in, std::vector<float>& lossByValue) {
  check(in);
  const double loss = absoluteError(in, lossByValue);
  if (in.beta == 1.0) return loss;
  const SsimValues values{in.index, in.residual, in.target, ssimConstants(in.peak)};
  const double scale = (1.0 - in.beta) / in.voxels;
  findWindows(values, in.within);
  const double dissimilar = dissimilarities(values);
  addGradient(values, scale, lossByValue);
  return loss + scale * dissimilar;
}

}  // namespace esvr
