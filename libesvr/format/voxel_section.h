#pragma once
/// A voxel layer as the content of a section, encoded by voxel_coder.h.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/memory_budget.h"
#include "esvr/voxel_layer.h"

namespace esvr::format {

[[nodiscard]] std::vector<std::byte> putVoxels(const VoxelLayer& layer);

/// \throws BadInput  the content is damaged; the text begins with `where`
/// \throws MemoryExceeded  there are more bricks than the budget allows
[[nodiscard]] VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where,
                                   MemoryBudget& budget);

}  // namespace esvr::format
