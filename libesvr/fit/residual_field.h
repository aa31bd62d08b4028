#pragma once
/// Residuals of a pass, read by voxel.

#include <span>

#include "core/brick_index.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// r = V - target over an engine's bricks; zero elsewhere, where both are background.
struct ResidualField {
  const BrickIndex& index;
  std::span<const float> values;  ///< kBrickVoxels a brick

  [[nodiscard]] std::span<const float> brick(std::size_t b) const {
    return values.subspan(b * kBrickVoxels, kBrickVoxels);
  }
  [[nodiscard]] float at(Coord voxel) const {
    const auto b = index.find(brickOf(voxel));
    return b == BrickIndex::kNone ? 0.0f : values[b * kBrickVoxels + voxelOffset(localOf(voxel))];
  }
};

}  // namespace esvr
