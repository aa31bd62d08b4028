#pragma once
/// Codes the voxels of a layer's bricks with a range coder. A brick may be a copy of voxels before
/// it (brick_copies.h). In all other bricks, each voxel is predicted from the voxels before it and
/// from its mirror image; the contexts depend on the errors of recent predictions.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/symbol_coder.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

/// The parameters of the coder, which a reader must know before the first voxel.
struct VoxelModel {
  static constexpr std::int32_t kNoMirror = -1;
  static constexpr std::size_t kMaxCommon = 15;

  std::int32_t vacantCode = 0;  ///< code of vacant voxels and of voxels without a brick
  /// The image of a voxel at p along an axis is at mirror - p, in voxels from the layer's origin.
  std::array<std::int32_t, 3> mirror{kNoMirror, kNoMirror, kNoMirror};
  std::vector<std::int32_t> common;  ///< frequent codes in decreasing order of frequency
};

/// What chooseCodes() weighs.
struct Thrift {
  static constexpr int kMaxSteps = 2;  ///< largest distance of a code from the nearest one
  std::vector<double> exact;           ///< the voxels in units of the lattice, as the layer's codes
  double bitPrice = 0.0;               ///< squared error, in the same units, that a bit is worth
  RoundedSigns signs = RoundedSigns::kMayChange;  ///< kKept: a code keeps its sign
};

/// What was coded before a limit stopped the coder.
struct CodedPart {
  std::uint64_t bytes = 0;
  std::size_t bricks = 0;
};

/// Replaces the code of a voxel that is not vacant by a code near it that takes fewer bits, if the
/// bits saved are worth more than the error added. The layer must have the form kQuantised. Bricks
/// are visited in the same order as by codeVoxels().
/// \param mostBytes  the coder stops after the brick with which it has more bytes than this
CodedPart chooseCodes(std::span<const std::size_t> order, const VoxelModel& model,
                      const Thrift& thrift, std::uint64_t mostBytes, VoxelLayer& layer);

/// The same part for the codes that the layer has.
[[nodiscard]] CodedPart codeWithin(std::span<const std::size_t> order, const VoxelModel& model,
                                   std::uint64_t mostBytes, const VoxelLayer& layer);

/// Writes the bricks in the given order, and the voxels of a brick in the order of their offsets.
/// A brick must come after all bricks none of whose coordinates is larger than its own.
void codeVoxels(Writer& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer);
/// Reads the codes and masks of a layer whose bricks are set.
/// \throws BadInput  a code is out of range
void codeVoxels(Reader& side, std::span<const std::size_t> order, const VoxelModel& model,
                VoxelLayer& layer);

}  // namespace esvr::codec
