#pragma once
/// The rule that turns a sum of ellipsoids into a voxel, for host and device. revoxelise() applies
/// it; RevoxeliseOptions (field.h) says what its parts mean.

#include <cmath>
#include <limits>

#include "esvr/field.h"
#include "esvr/kernel.h"

namespace esvr {

struct VoxelRule {
  float background = 0.0f;
  float low = -std::numeric_limits<float>::infinity();  ///< smaller sums become this
  float high = std::numeric_limits<float>::infinity();  ///< larger sums become this
  float threshold = 0.0f;
  bool narrowBand = false;

  /// The value that a voxel takes where it is active.
  [[nodiscard]] ESVR_HD float settled(float sum) const {
    return sum < low ? low : (high < sum ? high : sum);
  }
  /// How far a settled value is from being inactive.
  [[nodiscard]] ESVR_HD float activity(float settled) const {
    return narrowBand ? background - std::fabs(settled) : std::fabs(settled - background);
  }
  [[nodiscard]] ESVR_HD bool isActive(float settled) const { return activity(settled) > threshold; }
  /// The value that a voxel takes where it is not active.
  [[nodiscard]] ESVR_HD float inactiveValue(float settled) const {
    return narrowBand ? std::copysign(background, settled) : background;
  }
  /// The voxel of a sum.
  [[nodiscard]] ESVR_HD float operator()(float sum) const {
    const float value = settled(sum);
    return isActive(value) ? value : inactiveValue(value);
  }
};

/// \param options  its bricks take no part
[[nodiscard]] inline VoxelRule makeVoxelRule(float background, const RevoxeliseOptions& options) {
  VoxelRule rule{.background = background};
  if (options.range) rule.low = options.range->min, rule.high = options.range->max;
  rule.threshold = options.threshold;
  rule.narrowBand = options.narrowBand;
  return rule;
}

}  // namespace esvr
