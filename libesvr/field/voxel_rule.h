#pragma once
/// The rule that turns a sum of ellipsoids into a voxel, which revoxelise() applies. Its parameters
/// are explained in RevoxeliseOptions (field.h). The code is compiled for host and device.

#include <cmath>
#include <limits>

#include "esvr/block_levels.h"
#include "esvr/field.h"
#include "esvr/kernel.h"

namespace esvr {

struct VoxelRule {
  float background = 0.0f;
  float low = -std::numeric_limits<float>::infinity();  ///< smaller sums are clamped to this
  float high = std::numeric_limits<float>::infinity();  ///< larger sums are clamped to this
  float threshold = 0.0f;
  bool narrowBand = false;

  /// The clamped sum, which is the value of an active voxel.
  [[nodiscard]] ESVR_HD float settled(float sum) const {
    return sum < low ? low : (high < sum ? high : sum);
  }
  /// The activity of a settled value. A voxel is active if it is above the threshold.
  [[nodiscard]] ESVR_HD float activity(float settled) const {
    return narrowBand ? background - std::fabs(settled) : std::fabs(settled - background);
  }
  [[nodiscard]] ESVR_HD bool isActive(float settled) const { return activity(settled) > threshold; }
  /// The same with the threshold of a level (block_levels.h).
  [[nodiscard]] ESVR_HD bool isActive(float settled, int level) const {
    return activity(settled) > thresholdAt(threshold, level);
  }
  /// The value of an inactive voxel.
  [[nodiscard]] ESVR_HD float inactiveValue(float settled) const {
    return narrowBand ? std::copysign(background, settled) : background;
  }
  /// The value of the voxel that a sum becomes.
  [[nodiscard]] ESVR_HD float operator()(float sum) const {
    const float value = settled(sum);
    return isActive(value) ? value : inactiveValue(value);
  }
};

/// \param options  its bricks are not used
[[nodiscard]] inline VoxelRule makeVoxelRule(float background, const RevoxeliseOptions& options) {
  VoxelRule rule{.background = background};
  if (options.range) rule.low = options.range->min, rule.high = options.range->max;
  rule.threshold = options.threshold;
  rule.narrowBand = options.narrowBand;
  return rule;
}

}  // namespace esvr
