#pragma once
/// Chooses the parameters of the voxel coder for a layer.

#include "codec/voxel_coder.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

/// Finds frequent codes (for floats and halves only) and, along each axis, the mirror under which
/// the most voxels of a sample are equal, if there is a good one.
[[nodiscard]] VoxelModel chooseModel(const VoxelLayer& layer);

[[nodiscard]] bool hasMirror(const VoxelModel& model);
[[nodiscard]] VoxelModel withoutMirrors(VoxelModel model);

}  // namespace esvr::codec
