#pragma once
/// The bits that the active mask of a brick takes, estimated with the contexts of the voxel coder
/// (voxel_halo.h) and the state in an expected mask, and what changes of the mask would save.

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/brick_index.h"
#include "esvr/sparse_volume.h"

namespace esvr::codec {

/// A brick with one layer of the voxels around it.
class MaskCube {
 public:
  static constexpr int kSide = kBrickSide + 2;
  static constexpr int kCells = kSide * kSide * kSide;
  static constexpr int kBricks = 27;  ///< the brick itself and those around it

  /// The step to one of these bricks, from -1 to 1 along each axis.
  [[nodiscard]] static Coord step(int brick) {
    return {brick / 9 - 1, brick / 3 % 3 - 1, brick % 3 - 1};
  }

  /// The masks of a brick; null: there is none.
  struct Masks {
    const BrickMask* own = nullptr;
    const BrickMask* expected = nullptr;  ///< a guess of it that a decoder has too
  };

  /// \param find  find(step) returns the Masks of the brick at a step
  template <class Find>
  void fill(const Find& find) {
    for (int n = 0; n < kBricks; ++n) fillPart(step(n), find(step(n)));
  }

  /// Place of a voxel, whose coordinates are from -1 to kBrickSide.
  [[nodiscard]] static std::size_t at(int x, int y, int z) {
    return std::size_t(((x + 1) * kSide + y + 1) * kSide + z + 1);
  }

  [[nodiscard]] bool active(std::size_t at) const { return active_[at] != 0; }
  void set(std::size_t at, bool active) { active_[at] = active; }
  /// False if no brick has the voxel, which takes no bits then.
  [[nodiscard]] bool isCoded(std::size_t at) const { return coded_[at] != 0; }

  /// The context of a voxel with coordinates from 0 to kBrickSide.
  [[nodiscard]] std::size_t context(std::size_t at) const {
    std::size_t bits = expected_[at];
    for (const std::size_t back : kBack) bits = bits << 1 | active_[at - back];
    return bits;
  }

 private:
  static constexpr std::size_t kX = std::size_t(kSide) * kSide, kY = kSide;
  /// The voxels before a voxel, in the order of Halo::activityAround().
  static constexpr std::array kBack{kX, kY, std::size_t{1}, kX + kY, kX + 1, kY + 1, kX + kY + 1};

  void fillPart(Coord step, const Masks& masks);

  std::array<std::uint8_t, kCells> active_{}, coded_{}, expected_{};
};

/// The bits of a voxel by its context and its state.
struct MaskCosts {
  static constexpr std::size_t kContexts = 256;

  std::array<std::array<float, 2>, kContexts> bits{};

  [[nodiscard]] float of(const MaskCube& cube, std::size_t at) const {
    return cube.isCoded(at) ? bits[cube.context(at)][cube.active(at)] : 0.0f;
  }
};

/// Counts of the contexts and states of the voxels of bricks.
class MaskCounts {
 public:
  void add(const MaskCube& cube);
  /// Adds a brick whose voxels are, like those around it, all in one state.
  /// \param expected  the state of all of its voxels in the expected mask
  void addUniform(bool active, bool expected) {
    constexpr std::size_t kStates = MaskCosts::kContexts / 2;
    counts_[(expected ? kStates : 0) + (active ? kStates - 1 : 0)][active] += kBrickVoxels;
  }
  void add(const MaskCounts& other);
  [[nodiscard]] MaskCosts costs() const;

 private:
  std::array<std::array<std::uint64_t, 2>, MaskCosts::kContexts> counts_{};
};

}  // namespace esvr::codec
