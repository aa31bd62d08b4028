#include "fit/paper/ssim_gradient.h"

#include <algorithm>
#include <numeric>

#include "fit/paper/ssim_math.h"

namespace esvr {
namespace {

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

}  // namespace

Box nonZeroBox(const SsimValues& values, std::size_t brick) {
  const std::size_t at = brick * kBrickVoxels;
  const float* r = &values.residual[at];
  const float* t = at < values.target.size() ? &values.target[at] : r;  // r if there is no target
  Box box;
  for (int v = 0; v < kBrickVoxels; ++v)
    if (r[v] != 0.0f || t[v] != 0.0f) box.expand(voxelLocal(v));
  return box;
}

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

}  // namespace esvr
