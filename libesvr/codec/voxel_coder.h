#pragma once
/// The values that the codes of a voxel layer stand for (VoxelForm), and the codes of values.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/brick_index.h"
#include "esvr/quantised.h"

namespace esvr::codec {

/// The float and the half with a number in increasing order.
[[nodiscard]] float floatAt(std::int32_t n);
[[nodiscard]] float halfAt(std::int32_t n);

[[nodiscard]] std::int32_t orderOfFloat(float v);
/// The number of the half that is nearest to v among those of no larger magnitude. v is a half if
/// halfAt() of the result equals v.
[[nodiscard]] std::int32_t orderOfHalf(float v);
[[nodiscard]] bool inOrder(float a, float b);
/// The half that is nearest to v, ties to the even one. A value beyond 65504 becomes 65504 with its
/// sign, and a negative value that would become 0 becomes the negative half next to 0, so that
/// nothing leaves the halfs or changes its side of 0. NaN remains NaN.
[[nodiscard]] float nearestHalf(float v);

/// A layer without bricks that has the place of another one, its background and the meaning of its codes.
[[nodiscard]] VoxelLayer headOf(const VoxelLayer& layer);
/// Some bricks of a layer. \param bricks  their numbers, increasing
[[nodiscard]] VoxelLayer partOf(const VoxelLayer& layer, std::span<const std::size_t> bricks);

/// The value of a code of a layer. A code of the form kPalette must be in the palette.
[[nodiscard]] float valueOfCode(const VoxelLayer& layer, std::int32_t code);
/// The code of the value: the nearest one for kQuantised, and the exact one of values that the other
/// forms have.
[[nodiscard]] std::int32_t codeOfValue(const VoxelLayer& layer, float value);
/// The same for all voxels of a brick.
void valuesOfCodes(const VoxelLayer& layer, std::span<const std::int32_t> codes,
                   std::span<float> values);
void codesOfValues(const VoxelLayer& layer, std::span<const float> values,
                   std::span<std::int32_t> codes);

/// A brick together with one layer of the voxels before it along every axis, which a coder of voxels reads.
struct Halo {
  static constexpr int kSide = kBrickSide + 1;
  static constexpr int kStepX = kSide * kSide, kStepY = kSide, kStepZ = 1;
  static constexpr int kCells = kSide * kSide * kSide;

  std::array<std::int32_t, kCells> code;

  static int cell(Coord local) {
    return (local.x + 1) * kStepX + (local.y + 1) * kStepY + local.z + 1;
  }

  /// The bricks before a brick, each with the number 4 x + 2 y + z, where x, y and z are 0 along the axes on which it is
  /// lower and 1 along the others. BrickIndex::kNone stands for a brick that does not exist.
  using Before = std::array<std::uint32_t, 7>;
  /// The numbers of those along x, y and z.
  static constexpr std::array<std::size_t, 3> kFaces{3, 5, 6};

  [[nodiscard]] static Coord stepTo(std::size_t number) {
    const auto n = std::int32_t(number);
    return {(n >> 2 & 1) - 1, (n >> 1 & 1) - 1, (n & 1) - 1};
  }

  /// \param index  finds bricks as BrickIndex::find
  template <class Index>
  [[nodiscard]] static Before bricksBefore(const VoxelLayer& layer, const Index& index,
                                           std::size_t b) {
    Before before;
    for (std::size_t n = 0; n < before.size(); ++n)
      before[n] = index.find(layer.bricks[b] + stepTo(n));
    return before;
  }

  /// Calls visit(cell, neighbour, offset, count) for runs along z of the voxels before a brick. `cell` is the first one,
  /// `neighbour` the brick that has them, or BrickIndex::kNone, `offset` says where in its brick the first one is, and
  /// `count` is 8 or 1.
  template <class Visit>
  static void forEachLine(const Before& before, const Visit& visit) {
    for (std::size_t n = 0; n < before.size(); ++n) {
      const Coord step = stepTo(n);
      const auto first = [](int s) { return s < 0 ? -1 : 0; };
      const auto last = [](int s) { return s < 0 ? -1 : kBrickSide - 1; };
      for (int x = first(step.x); x <= last(step.x); ++x)
        for (int y = first(step.y); y <= last(step.y); ++y) {
          const Coord local{x, y, first(step.z)};
          visit(std::size_t(cell(local)), before[n], voxelOffset(localOf(local)),
                step.z < 0 ? 1 : kBrickSide);
        }
    }
  }

  /// Copies the codes of the voxels before a brick. Those of the brick itself are not set here, because the coder sets
  /// each of them before it is read.
  /// \param vacantCode  code for voxels that no brick has
  void fillCodes(const VoxelLayer& layer, const Before& before, std::int32_t vacantCode) {
    forEachLine(before, [&](std::size_t at, std::uint32_t neighbour, int v, int count) {
      if (neighbour == BrickIndex::kNone)
        std::fill_n(&code[at], count, vacantCode);
      else
        std::copy_n(&layer.codes[neighbour * std::size_t(kBrickVoxels) + std::size_t(v)], count,
                    &code[at]);
    });
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
[[nodiscard]] std::vector<Stream> encodeVoxels(const VoxelModel& model, const VoxelLayer& layer);

/// Reads the codes and masks of a layer whose bricks are set.
/// \param streams  the stream of each block, blockCount() of them
/// \throws BadInput  a code is out of range
void decodeVoxels(std::span<const StreamView> streams, const VoxelModel& model, VoxelLayer& layer);

/// What chooseCodes() weighs.
struct Thrift {
  static constexpr int kMaxSteps = 2;  ///< largest distance of a code from the nearest one
  std::vector<double> exact;           ///< the voxels in units of the lattice, as the layer's codes
  double bitPrice = 0.0;               ///< squared error, in the same units, that a bit is worth
  RoundedSigns signs = RoundedSigns::kMayChange;  ///< kKept: a code keeps its sign
  double massPrice = 0.0;                         ///< ThriftOptions::massPrice
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

/// The bytes of the codes that a layer has.
[[nodiscard]] std::uint64_t bytesOfCodes(const VoxelModel& model, const VoxelLayer& layer);

}  // namespace esvr::codec
