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

#include "codec/range_coder.h"
#include "core/brick_index.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// A brick together with one layer of the voxels before it along every axis, which a coder of voxels reads.
struct Halo {
  static constexpr int kSide = kBrickSide + 1;
  static constexpr int kStepX = kSide * kSide, kStepY = kSide, kStepZ = 1;
  static constexpr int kCells = kSide * kSide * kSide;

  std::array<std::int32_t, kCells> code;
  std::array<bool, kCells> active;

  static int cell(Coord local) {
    return (local.x + 1) * kStepX + (local.y + 1) * kStepY + local.z + 1;
  }

  /// Calls visit(cell) for the cells of the voxels before the brick.
  template <class Visit>
  static void forEachBefore(const Visit& visit) {
    for (int cell = 0; cell < kStepX; ++cell) visit(std::size_t(cell));
    for (int x = 1; x < kSide; ++x) {
      for (int z = 0; z < kSide; ++z) visit(std::size_t(x * kStepX + z));
      for (int y = 1; y < kSide; ++y) visit(std::size_t(x * kStepX + y * kStepY));
    }
  }

  /// Copies the voxels that lie before brick b. The voxels of the brick itself are not set here,
  /// because the coder sets each of them before it is read.
  /// \param index       finds bricks as BrickIndex::find
  /// \param vacantCode  code for voxels that no brick has
  template <class Index>
  void fill(const VoxelLayer& layer, const Index& index, std::size_t b, std::int32_t vacantCode) {
    forEachBefore(layer, index, b, [&](std::size_t at, std::uint32_t neighbour, int v) {
      const bool there = neighbour != BrickIndex::kNone;
      code[at] =
          there ? layer.codes[neighbour * std::size_t(kBrickVoxels) + std::size_t(v)] : vacantCode;
      active[at] = there && layer.active[neighbour].test(v);
    });
  }

  /// Calls visit(cell, neighbour, offset) for the cells of the voxels that lie before brick b.
  /// `neighbour` is the brick that has the voxel, or BrickIndex::kNone, and `offset` says where in
  /// its brick the voxel is.
  template <class Index, class Visit>
  static void forEachBefore(const VoxelLayer& layer, const Index& index, std::size_t b,
                            const Visit& visit) {
    for (int corner = 0; corner < 7; ++corner) {  // corner 7 is the brick itself
      const Coord step{(corner >> 2 & 1) - 1, (corner >> 1 & 1) - 1, (corner & 1) - 1};
      forEachOf(index.find(layer.bricks[b] + step), step, visit);
    }
  }

  /// The activities of the seven voxels before a voxel, as bits from the highest to the lowest: A,
  /// B, C (before it along x, y, z), AB, AC, BC, ABC (along two or three axes).
  [[nodiscard]] std::size_t activityAround(int cell) const {
    std::size_t bits = 0;
    for (const int back : {kStepX, kStepY, kStepZ, kStepX + kStepY, kStepX + kStepZ,
                           kStepY + kStepZ, kStepX + kStepY + kStepZ})
      bits = bits << 1 | std::size_t(active[std::size_t(cell - back)]);
    return bits;
  }

  /// The same for a voxel whose neighbour before it along z has been coded last.
  /// \param before   the activities around that neighbour
  /// \param current  whether that neighbour is active
  [[nodiscard]] std::size_t activityAfter(std::size_t before, bool current, int cell) const {
    const auto bit = [&](int back) { return std::size_t(active[std::size_t(cell - back)]); };
    const std::size_t kept = (before >> 4 & 4u) | (before >> 4 & 2u) | (before >> 3 & 1u);
    return bit(kStepX) << 6 | bit(kStepY) << 5 | std::size_t(current) << 4 |
           bit(kStepX + kStepY) << 3 | kept;
  }

 private:
  /// Visits the last slice of a neighbour along every axis on which the step is -1.
  template <class Visit>
  static void forEachOf(std::uint32_t neighbour, Coord step, const Visit& visit) {
    const auto first = [](int s) { return s < 0 ? -1 : 0; };
    const auto last = [](int s) { return s < 0 ? -1 : kBrickSide - 1; };
    for (int x = first(step.x); x <= last(step.x); ++x)
      for (int y = first(step.y); y <= last(step.y); ++y)
        for (int z = first(step.z); z <= last(step.z); ++z)
          visit(std::size_t(cell({x, y, z})), neighbour, voxelOffset(localOf({x, y, z})));
  }
};

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
