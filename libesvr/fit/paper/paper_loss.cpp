#include "fit/paper/paper_loss.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include "core/parallel.h"
#include "esvr/error.h"
#include "fit/paper/ssim_math.h"

namespace esvr {
namespace {

// --- The windows of one brick.

/// The values of the bricks around a brick; null for missing bricks and beyond the array's end.
ValuesAround<float> valuesAround(std::span<const float> values, const BricksAround& around) {
  ValuesAround<float> result;
  std::transform(around.begin(), around.end(), result.begin(), [&](std::uint32_t brick) {
    const std::size_t at = std::size_t(brick) * kBrickVoxels;
    return brick != BrickIndex::kNone && at < values.size() ? &values[at] : nullptr;
  });
  return result;
}

template <class Value>
ValuesAround<Value> gradientsAround(const std::vector<WindowGradients>& gradients,
                                    const BricksAround& around,
                                    std::array<Value, kBrickVoxels> WindowGradients::*member) {
  ValuesAround<Value> result;
  std::transform(around.begin(), around.end(), result.begin(), [&](std::uint32_t brick) {
    return brick != BrickIndex::kNone ? (gradients[brick].*member).data() : nullptr;
  });
  return result;
}

/// Visits the offsets of the first voxels of a box's rows along z.
template <class Visit>
void forEachRow(const Box& voxels, Visit&& visit) {
  for (int x = voxels.min.x; x <= voxels.max.x; ++x)
    for (int y = voxels.min.y; y <= voxels.max.y; ++y) visit(voxelOffset({x, y, 0}));
}

/// Bounding box of a brick's voxels at which the residual or the target is not zero.
Box nonZeroBox(const SsimValues& values, std::size_t brick) {
  const std::size_t at = brick * kBrickVoxels;
  const float* r = &values.residual[at];
  const float* t = at < values.target.size() ? &values.target[at] : r;  // r if there is no target
  Box box;
  for (int v = 0; v < kBrickVoxels; ++v)
    if (r[v] != 0.0f || t[v] != 0.0f) box.expand(voxelLocal(v));
  return box;
}

/// Evaluates the windows around the voxels of one brick, with the buffers of one thread.
class WindowSide {
 public:
  /// \param extent  Windows::supports and Windows::reached of the brick
  /// \return the sum of 1 - SSIM
  double evaluate(const SsimValues& values, Coord brick, const SsimWindow::Extent& extent,
                  WindowGradients& out);

 private:
  double differentiate(const SsimConstants& constants, const Box& voxels,
                       WindowGradients& out) const;

  SsimWindow window_;
  HaloValues t_, r_;
  BrickSums sumT_, sumTt_, sumR_, sumRr_, sumTr_;
};

double WindowSide::evaluate(const SsimValues& values, Coord brick, const SsimWindow::Extent& extent,
                            WindowGradients& out) {
  const BricksAround around = bricksAround(values.index, brick);
  fillHalo(valuesAround(values.target, around), extent.read(), t_);
  fillHalo(valuesAround(values.residual, around), extent.read(), r_);
  window_.sum(t_, extent, sumT_);
  window_.sum(r_, extent, sumR_);
  window_.sumProducts(t_, t_, extent, sumTt_);
  window_.sumProducts(r_, r_, extent, sumRr_);
  window_.sumProducts(t_, r_, extent, sumTr_);
  return differentiate(values.constants, extent.voxels, out);
}

double WindowSide::differentiate(const SsimConstants& constants, const Box& voxels,
                                 WindowGradients& out) const {
  out = {};
  std::array<double, kBrickSide> sums{};  // one sum for each z, which allows SIMD over a row
  forEachRow(voxels, [&](int row) {
    for (int z = 0; z < kBrickSide; ++z) {
      const int v = row + z;
      const Dissimilarity d =
          dissimilarity({sumT_[v], sumTt_[v], sumR_[v], sumRr_[v], sumTr_[v]}, constants);
      out.byR[v] = d.byR;
      out.byRr[v] = d.byRr;
      out.byTr[v] = d.byTr;
      sums[z] += d.value;
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// Evaluates the derivatives by the values of one brick, with the buffers of one thread. Because
/// the window is symmetric, a value's weights in the windows around it are those of its own window.
class ValueSide {
 public:
  /// \param brick    number of the brick in the index of the values
  /// \param nonZero  nonZeroBox of the brick
  /// \return derivatives of the sum of 1 - SSIM, valid until the next call
  const BrickSums& evaluate(const SsimValues& values, std::size_t brick, const Box& nonZero,
                            const Windows& windows);

 private:
  template <class Value>
  void sum(const ValuesAround<Value>& values, const SsimWindow::Extent& extent, BrickSums& out);
  void addProducts(const SsimValues& values, std::size_t brick, const Box& nonZero);

  SsimWindow window_;
  HaloValues halo_;
  BrickSums byR_, byRr_, byTr_;
};

template <class Value>
void ValueSide::sum(const ValuesAround<Value>& values, const SsimWindow::Extent& extent,
                    BrickSums& out) {
  fillHalo(values, extent.read(), halo_);
  window_.sum(halo_, extent, out);
}

const BrickSums& ValueSide::evaluate(const SsimValues& values, std::size_t brick,
                                     const Box& nonZero, const Windows& windows) {
  const BricksAround around = bricksAround(windows.index, values.index.bricks()[brick]);
  const Box support = haloSupport(around, windows.reached);
  const auto& gradients = windows.gradients;
  sum(gradientsAround(gradients, around, &WindowGradients::byR), {support, kWholeBrick}, byR_);
  sum(gradientsAround(gradients, around, &WindowGradients::byRr), {support, nonZero}, byRr_);
  sum(gradientsAround(gradients, around, &WindowGradients::byTr), {support, nonZero}, byTr_);
  addProducts(values, brick, nonZero);
  return byR_;
}

void ValueSide::addProducts(const SsimValues& values, std::size_t brick, const Box& nonZero) {
  const std::size_t at = brick * kBrickVoxels;
  const double byC2 = 1.0 / values.constants.c2;
  const bool isTarget = at < values.target.size();
  forEachRow(nonZero, [&](int row) {
    for (int v = row; v < row + kBrickSide; ++v) {
      const double r = values.residual[at + v], t = isTarget ? values.target[at + v] : 0.0f;
      byR_[v] += (2.0 * r * byRr_[v] + t * byTr_[v]) * byC2;
    }
  });
}

// --- The loss.

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
  constexpr std::size_t kBricksPerTask = 8;
  using Range = tbb::blocked_range<std::size_t>;
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
