#pragma once
/// The rule by which the sum of a stored grid becomes voxels.

#include "esvr/container.h"
#include "field/voxel_rule.h"

namespace esvr::format {

[[nodiscard]] VoxelRule ruleOf(const StoredGrid& grid);

}  // namespace esvr::format
