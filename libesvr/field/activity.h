#pragma once
/// Which voxels of a field are active: the rule that revoxelise() applies, written once for it and
/// for those who choose its threshold.

#include <algorithm>
#include <cmath>

namespace esvr {

/// A voxel is active where activity(settled(V)) > threshold.
struct ActivityRule {
  float background = 0.0f;
  bool nonNegative = false;
  bool narrowBand = false;  ///< see RevoxeliseOptions

  /// The value that a voxel takes where it is active.
  [[nodiscard]] float settled(float value) const {
    return nonNegative ? std::max(value, 0.0f) : value;
  }
  [[nodiscard]] float activity(float value) const {
    return narrowBand ? background - std::abs(value) : std::abs(value - background);
  }
  /// The value that a voxel takes where it is not.
  [[nodiscard]] float inactiveValue(float value) const {
    return narrowBand ? std::copysign(background, value) : background;
  }
};

}  // namespace esvr
