#pragma once
/// A voxel layer as the content of a section: coded by what foretells them (voxel_coder.h).

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "esvr/voxel_layer.h"

namespace esvr::format {

[[nodiscard]] std::vector<std::byte> putVoxels(const VoxelLayer& layer);

/// \throws BadInput  damaged; begins with `where`
[[nodiscard]] VoxelLayer getVoxels(std::span<const std::byte> content, const std::string& where);

}  // namespace esvr::format
