#pragma once
/// A brick together with one layer of the voxels before it along every axis, which the voxel coder
/// reads.

#include <array>
#include <cstdint>

#include "core/brick_index.h"
#include "esvr/voxel_layer.h"

namespace esvr::codec {

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
  /// `neighbour` is the brick that has the voxel, or BrickIndex::kNone, and `offset` is the place
  /// of the voxel in its brick.
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

}  // namespace esvr::codec
