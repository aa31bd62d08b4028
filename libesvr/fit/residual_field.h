#pragma once
/// Residuals of a pass by voxel.

#include <span>

#include "core/brick_index.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The residuals r = V - target in the bricks of a pass; they are zero elsewhere.
struct ResidualField {
  const BrickIndex& index;
  std::span<const float> values;  ///< kBrickVoxels values for each brick

  [[nodiscard]] std::span<const float> brick(std::size_t b) const {
    return values.subspan(b * kBrickVoxels, kBrickVoxels);
  }
  [[nodiscard]] float at(Coord voxel) const {
    const auto b = index.find(brickOf(voxel));
    return b == BrickIndex::kNone ? 0.0f : values[b * kBrickVoxels + voxelOffset(localOf(voxel))];
  }
};

}  // namespace esvr
