#pragma once
/// Finds the properties that a layer's voxels share, before they are coded.

#include "codec/voxel_coder.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

/// Codes that many voxels have, where voxels are floats or halves; along each axis the mirror that
/// most of a sample of voxels is alike under, where there is one.
[[nodiscard]] VoxelModel chooseModel(const VoxelLayer& layer);

[[nodiscard]] bool hasMirror(const VoxelModel& model);
[[nodiscard]] VoxelModel withoutMirrors(VoxelModel model);

}  // namespace esvr::codec
