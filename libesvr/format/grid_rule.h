#pragma once
/// The rule that determines the voxels of a stored grid from its sum of ellipsoids.

#include <limits>

#include "esvr/container.h"
#include "field/voxel_rule.h"

namespace esvr::format {

/// A threshold below every activity.
inline constexpr float kAlwaysActive = -std::numeric_limits<float>::max();

[[nodiscard]] VoxelRule ruleOf(const StoredGrid& grid);

}  // namespace esvr::format
