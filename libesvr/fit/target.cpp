#include "fit/target.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "esvr/metrics.h"

namespace esvr {
namespace {

/// The range of all values, active or not.
ValueRange rangeOfAll(std::span<const float> values) {
  using Range = tbb::blocked_range<std::size_t>;
  return tbb::parallel_reduce(
      Range(0, values.size(), kBrickVoxels), ValueRange::none(),
      [&](const Range& part, ValueRange range) {
        for (std::size_t i = part.begin(); i != part.end(); ++i) range.expand(values[i]);
        return range;
      },
      [](ValueRange a, const ValueRange& b) {
        a.expand(b);
        return a;
      });
}

/// The power of two that scales `largest` to [0.5, 1).
double powerOfTwoScale(double largest) {
  if (largest == 0.0) return 1.0;
  int exponent = 0;
  std::frexp(largest, &exponent);
  return std::ldexp(1.0, -exponent);
}

}  // namespace

FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box) {
  FitTarget target;
  target.bricks = volume.bricks;
  target.active = &volume.active;
  target.activeVoxels = activeVoxelCount(volume);
  const ValueRange range = rangeOfAll(volume.values);
  const double background = volume.background;
  target.scale = powerOfTwoScale(std::max(range.max - background, background - range.min));
  target.peak = peakOf(volume) * target.scale;
  const Box b = box.value_or(activeBox(volume));
  target.boxVoxels = b.volume();
  target.box = {b.min - volume.origin, b.max - volume.origin};
  const auto scaled = [&](float v) { return float((double(v) - background) * target.scale); };
  target.lowest = std::min(0.0, double(scaled(range.min)));
  target.highest = std::max(0.0, double(scaled(range.max)));
  target.values.resize(volume.values.size());
  tbb::parallel_for(std::size_t{0}, volume.brickCount(), [&](std::size_t n) {
    const auto values = volume.brickValues(n);
    std::transform(values.begin(), values.end(),
                   target.values.begin() + std::ptrdiff_t(n * kBrickVoxels), scaled);
  });
  return target;
}

}  // namespace esvr
