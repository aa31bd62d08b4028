#pragma once
/// Codes the voxels of a layer's bricks with range coders (docs/format.md, "Voxels").
///
/// The bricks are divided into blocks of up to 2^20 voxels. A block has its own stream and its own
/// models, and no voxel of it is predicted from another block, so that all threads write and read at
/// the same time. A layer of up to 2^20 voxels in bricks is one block. The number of threads changes
/// no byte.

#include <array>
#include <cstddef>
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

/// Finds frequent codes (for floats and halves only) and, along each axis, the mirror under which
/// the largest number of a sample's voxels are equal, if it is large enough.
[[nodiscard]] VoxelModel chooseModel(const VoxelLayer& layer);
[[nodiscard]] bool hasMirror(const VoxelModel& model);
[[nodiscard]] VoxelModel withoutMirrors(VoxelModel model);

/// The number of blocks that a layer is divided into. A layer with mirrors is one block, because the
/// image of a voxel may be anywhere in it.
[[nodiscard]] std::uint64_t blockCount(std::uint64_t bricks, const VoxelModel& model);

using Stream = std::vector<std::byte>;
using StreamView = std::span<const std::byte>;

/// Writes the stream of each block.
/// \param first  the writer of the first block, which may have written something else before
[[nodiscard]] std::vector<Stream> encodeVoxels(Writer first, const VoxelModel& model,
                                               const VoxelLayer& layer);

/// Reads the codes and masks of a layer whose bricks are set.
/// \param first   the reader of the first block, which may have read something else before
/// \param others  the streams of the other blocks, blockCount() - 1 of them
/// \throws BadInput  a code is out of range
void decodeVoxels(const Reader& first, std::span<const StreamView> others, const VoxelModel& model,
                  VoxelLayer& layer);

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
/// bits saved are worth more than the error added. The layer must have the form kQuantised.
/// \param mostBytes  the coder stops soon after it has more bytes than this
CodedPart chooseCodes(const VoxelModel& model, const Thrift& thrift, std::uint64_t mostBytes,
                      VoxelLayer& layer);

/// The same part for the codes that the layer has.
[[nodiscard]] CodedPart codeWithin(const VoxelModel& model, std::uint64_t mostBytes,
                                   const VoxelLayer& layer);

}  // namespace esvr::codec
