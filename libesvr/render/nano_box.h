#pragma once
/// Bounds the samples of a NanoVDB grid that can differ from its background.

#include "esvr/nano_volume.h"
#include "render/ray_box.h"

namespace esvr {

/// The box of all places whose interpolation reads a voxel of a leaf; empty for a grid without
/// leaves.
[[nodiscard]] inline PlaceBox sampledBox(const NanoVolume& volume) {
  const Coord low = volume.voxels.min, high = volume.voxels.max;
  if (volume.voxels.empty()) return {{1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}};
  return {{low.x - 1.0, low.y - 1.0, low.z - 1.0}, {high.x + 1.0, high.y + 1.0, high.z + 1.0}};
}

}  // namespace esvr
