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
  using ValueSpan = tbb::blocked_range<std::size_t>;
  return tbb::parallel_reduce(
      ValueSpan(0, values.size(), kBrickVoxels), ValueRange::none(),
      [&](const ValueSpan& part, ValueRange range) {
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

float scaled(float value, double background, double scale) {
  return float((double(value) - background) * scale);
}

}  // namespace

TargetScale scaleOf(const SparseVolume& volume) {
  const ValueRange range = rangeOfAll(volume.values);
  const double background = volume.background;
  TargetScale scale;
  scale.scale = powerOfTwoScale(std::max(range.max - background, background - range.min));
  scale.peak = peakOf(volume) * scale.scale;
  scale.lowest = std::min(0.0, double(scaled(range.min, background, scale.scale)));
  scale.highest = std::max(0.0, double(scaled(range.max, background, scale.scale)));
  return scale;
}

Box boxOf(const SparseVolume& volume, const std::optional<Box>& box) {
  const Box b = box.value_or(activeBox(volume));
  return {b.min - volume.origin, b.max - volume.origin};
}

FitTarget makeTarget(const SparseVolume& part, const Box& box, const TargetScale& scale) {
  FitTarget target;
  static_cast<TargetScale&>(target) = scale;
  target.bricks = part.bricks;
  target.seedBricks = part.brickCount();
  target.active = &part.active;
  target.activeVoxels = activeVoxelCount(part);
  target.boxVoxels = box.volume();
  target.box = box;
  target.values.resize(part.values.size());
  const double background = part.background;
  tbb::parallel_for(std::size_t{0}, part.brickCount(), [&](std::size_t b) {
    const auto values = part.brickValues(b);
    std::transform(values.begin(), values.end(),
                   target.values.begin() + std::ptrdiff_t(b * kBrickVoxels),
                   [&](float v) { return scaled(v, background, scale.scale); });
  });
  return target;
}

FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box) {
  return makeTarget(volume, boxOf(volume, box), scaleOf(volume));
}

}  // namespace esvr
