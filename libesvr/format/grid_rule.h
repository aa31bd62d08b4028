#pragma once
/// The rule that determines the voxels of a stored grid from its sum of ellipsoids.

#include "esvr/container.h"
#include "field/voxel_rule.h"

namespace esvr::format {

[[nodiscard]] VoxelRule ruleOf(const StoredGrid& grid);

}  // namespace esvr::format
