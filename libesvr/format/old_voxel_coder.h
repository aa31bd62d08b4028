#pragma once
/// The voxels of a layer's bricks as decisions of a range coder, the way format 1.1 wrote them.
/// Read only: voxel_coder.h is what is written.

#include <cstdint>
#include <span>

#include "esvr/voxel_layer.h"
#include "format/symbol_coder.h"

namespace esvr::format {

/// Fills the codes and masks of a layer whose bricks are set. Bricks come in the order given, which
/// must have every brick after those whose coordinates are nowhere above its own. Voxels in the
/// order of their offsets.
/// \param vacantCode  what a voxel counts as where there is none
void readOldVoxels(Reader& side, std::span<const std::size_t> order, std::int32_t vacantCode,
                   VoxelLayer& layer);

}  // namespace esvr::format
