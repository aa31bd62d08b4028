#include "fit/target.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

/// The range of all values, active or not.
ValueRange rangeOfAll(std::span<const float> values) {
  using ValueSpan = tbb::blocked_range<std::size_t>;
  return parallelReduce(
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

TargetScale scaleOf(const SparseVolume& volume, std::optional<double> peak) {
  const ValueRange range = rangeOfAll(volume.values);
  const double background = volume.background;
  TargetScale scale;
  scale.scale = powerOfTwoScale(std::max(range.max - background, background - range.min));
  scale.peak = (peak ? *peak : peakOf(volume)) * scale.scale;
  scale.lowest = std::min(0.0, double(scaled(range.min, background, scale.scale)));
  scale.highest = std::max(0.0, double(scaled(range.max, background, scale.scale)));
  return scale;
}

Box boxOf(const SparseVolume& volume, const std::optional<Box>& box) {
  const Box b = box.value_or(activeBox(volume));
  return {b.min - volume.origin, b.max - volume.origin};
}

FitTarget makeTarget(const VolumePart& part, const Box& box, const TargetScale& scale) {
  const SparseVolume& volume = part.volume;
  FitTarget target;
  static_cast<TargetScale&>(target) = scale;
  target.seedBricks = part.bricks.size();
  target.boxVoxels = box.volume();
  target.box = box;
  target.bricks.reserve(part.bricks.size());
  for (const std::uint32_t b : part.bricks) {
    target.bricks.push_back(volume.bricks[b]);
    target.activeVoxels += std::uint64_t(volume.active[b].count());
  }
  target.values.resize(part.bricks.size() * kBrickVoxels);
  const double background = volume.background;
  parallelFor(std::size_t{0}, part.bricks.size(), [&](std::size_t n) {
    const auto values = volume.brickValues(part.bricks[n]);
    std::transform(values.begin(), values.end(),
                   target.values.begin() + std::ptrdiff_t(n * kBrickVoxels),
                   [&](float v) { return scaled(v, background, scale.scale); });
  });
  return target;
}

FitTarget makeTarget(const SparseVolume& volume, const Box& box, const TargetScale& scale) {
  std::vector<std::uint32_t> all(volume.brickCount());
  std::iota(all.begin(), all.end(), 0u);
  FitTarget target = makeTarget({volume, all}, box, scale);
  target.active = &volume.active;
  return target;
}

FitTarget makeTarget(const SparseVolume& volume, const std::optional<Box>& box,
                     std::optional<double> peak) {
  return makeTarget(volume, boxOf(volume, box), scaleOf(volume, peak));
}

ValueRange rangeOf(float background, const TargetScale& scale) {
  return {float(background + scale.lowest / scale.scale),
          float(background + scale.highest / scale.scale)};
}

SignsAllowed signsOf(const FitTarget& target) {
  return {.positive = target.bothSigns || target.highest > 0.0,
          .negative = target.bothSigns || target.lowest < 0.0};
}

EllipsoidLimits limitsOf(const FitTarget& target, const Tuning& tuning) {
  const double range = target.highest - target.lowest;
  const double lowest = target.bothSigns ? -range : target.lowest;
  const double highest = target.bothSigns ? range : target.highest;
  return {tuning.smallestScale, std::min(tuning.largestScale, target.largestScale),
          tuning.intensityHeadroom * lowest, tuning.intensityHeadroom * highest};
}

int seedWindow(const FitTarget& target, std::size_t ellipsoids, const Tuning& tuning) {
  constexpr int kSmallest = 2, kLargest = 6;  // voxels
  const double distance =
      std::cbrt(double(target.activeVoxels) / double(std::max<std::size_t>(ellipsoids, 1)));
  return std::clamp(int(std::lround(tuning.seedWindow * distance)), kSmallest, kLargest);
}

FitSize sizeOf(const FitTarget& target) {
  return {target.bricks.size(), target.activeVoxels, target.narrowBand, !target.constants.empty()};
}

}  // namespace esvr
