#pragma once
/// Chooses the parameters of the voxel coder for a layer.

#include "codec/voxel_coder.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

/// Finds frequent codes (for floats and halves only) and, along each axis, the mirror under which
/// the largest number of a sample's voxels are equal, if it is large enough.
[[nodiscard]] VoxelModel chooseModel(const VoxelLayer& layer);

[[nodiscard]] bool hasMirror(const VoxelModel& model);
[[nodiscard]] VoxelModel withoutMirrors(VoxelModel model);

}  // namespace esvr::codec
