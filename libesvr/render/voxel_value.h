#pragma once
/// What revoxelise() makes of a sum at a voxel, for host and device.

#include <limits>

#include "esvr/field.h"
#include "esvr/kernel.h"

namespace esvr {

struct VoxelValue {
  float background;
  float low, high;  ///< values beyond become these
  float threshold;
  bool narrowBand;

  [[nodiscard]] ESVR_HD float operator()(float value) const {
    const float v = value < low ? low : (value > high ? high : value);
    const float size = v < 0.0f ? -v : v;
    const float away = v < background ? background - v : v - background;
    if ((narrowBand ? background - size : away) > threshold) return v;
    return narrowBand && v < 0.0f ? -background : background;
  }
};

/// \param voxels  its bricks are not looked at
[[nodiscard]] inline VoxelValue voxelValue(float background, const RevoxeliseOptions& voxels) {
  constexpr float kAll = std::numeric_limits<float>::infinity();
  const ValueRange range = voxels.range.value_or(ValueRange{-kAll, kAll});
  return {background, range.min, range.max, voxels.threshold, voxels.narrowBand};
}

}  // namespace esvr
