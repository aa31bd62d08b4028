#pragma once
/// Which voxels of a field are active: the rule that revoxelise() applies, written once for it and
/// for those who choose its threshold.

#include <algorithm>
#include <cmath>
#include <optional>

#include "esvr/sparse_volume.h"

namespace esvr {

/// A voxel is active where activity(settled(V)) > threshold.
struct ActivityRule {
  float background = 0.0f;
  std::optional<ValueRange> range{};  ///< see RevoxeliseOptions, as is the next
  bool narrowBand = false;

  /// The value that a voxel takes where it is active.
  [[nodiscard]] float settled(float value) const {
    return range ? std::clamp(value, range->min, range->max) : value;
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
