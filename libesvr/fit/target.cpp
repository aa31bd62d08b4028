#include "fit/target.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "esvr/metrics.h"

namespace esvr {
namespace {

double largestMagnitude(const SparseVolume& volume) {
  double largest = 0.0;
  for (const float v : volume.values)
    largest = std::max(largest, std::abs(double(v) - double(volume.background)));
  return largest;
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
  target.scale = powerOfTwoScale(largestMagnitude(volume));
  target.peak = peakOf(volume) * target.scale;
  const Box b = box.value_or(activeBox(volume));
  target.boxVoxels = b.volume();
  target.box = {b.min - volume.origin, b.max - volume.origin};
  target.values.resize(volume.values.size());
  std::transform(volume.values.begin(), volume.values.end(), target.values.begin(), [&](float v) {
    return float((double(v) - double(volume.background)) * target.scale);
  });
  const auto [low, high] = std::minmax_element(target.values.begin(), target.values.end());
  target.lowest = std::min(0.0, double(*low));
  target.highest = std::max(0.0, double(*high));
  return target;
}

}  // namespace esvr
