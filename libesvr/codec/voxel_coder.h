#pragma once
/// The voxels of a layer's bricks as decisions of a range coder: each is foretold from the voxels
/// before it and from its mirror images, in contexts of how well that went so far.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/symbol_coder.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

/// Both sides must know this before the first voxel.
struct VoxelModel {
  static constexpr std::int32_t kNoMirror = -1;
  static constexpr std::size_t kMaxCommon = 15;

  std::int32_t vacantCode = 0;  ///< the code that a missing voxel counts as
  /// Along each axis a voxel at p has its image at mirror - p, in voxels from the layer's origin.
  std::array<std::int32_t, 3> mirror{kNoMirror, kNoMirror, kNoMirror};
  std::vector<std::int32_t> common;  ///< codes that many voxels have, the most frequent first
};

/// Codes bricks in the order given, which must have every brick after those whose coordinates are
/// nowhere above its own. Voxels in the order of their offsets.
void codeVoxels(Writer& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer);
/// Fills the codes and masks of a layer whose bricks are set. \throws BadInput
void codeVoxels(Reader& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer);

}  // namespace esvr::codec
