#pragma once
/// A sparse scalar field on the integer lattice: 8^3 bricks where there are voxels, one background
/// value elsewhere. The library's only voxel container: OpenVDB and NanoVDB grids are turned into
/// it at the border (vdb_io.h), everything above works on it. Its size follows the bricks, never
/// the bounding box.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/coord.h"

namespace esvr {

inline constexpr int kBrickLog2 = 3;
inline constexpr int kBrickSide = 1 << kBrickLog2;                         ///< voxels along a side
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;  ///< 512

/// Offset of a voxel in its brick: x * 64 + y * 8 + z, z fastest, as in an OpenVDB leaf.
/// \param local  coordinates in the brick, each 0..7
constexpr int voxelOffset(Coord local) { return (local.x << 6) | (local.y << 3) | local.z; }
constexpr Coord voxelLocal(int offset) { return {offset >> 6, (offset >> 3) & 7, offset & 7}; }

/// Brick that holds a voxel (floor division, right for negative coordinates) and the voxel's place.
constexpr Coord brickOf(Coord v) {
  return {v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
}
constexpr Coord localOf(Coord v) {
  return {v.x & (kBrickSide - 1), v.y & (kBrickSide - 1), v.z & (kBrickSide - 1)};
}

/// One bit a voxel of a brick; word x holds the 64 voxels of slice x, bit y * 8 + z.
struct BrickMask {
  std::array<std::uint64_t, kBrickSide> words{};

  friend bool operator==(const BrickMask&, const BrickMask&) = default;
  [[nodiscard]] constexpr bool test(int offset) const {
    return (words[offset >> 6] >> (offset & 63)) & 1u;
  }
  void set(int offset) { words[offset >> 6] |= std::uint64_t{1} << (offset & 63); }
  void setAll() { words.fill(~std::uint64_t{0}); }
  [[nodiscard]] int count() const {
    int n = 0;
    for (auto w : words) n += std::popcount(w);
    return n;
  }
};

/// Bricks in strictly increasing order of Coord; arrays run parallel to `bricks`.
struct SparseVolume {
  Coord origin;               ///< index coordinates of brick (0,0,0)'s first voxel; multiples of 8
  float background = 0.0f;    ///< value outside the bricks
  std::vector<Coord> bricks;  ///< brick positions relative to `origin`, in bricks, each >= 0
  std::vector<float> values;  ///< kBrickVoxels a brick, the grid's values (background included)
  std::vector<BrickMask> active;  ///< the active voxels

  [[nodiscard]] std::size_t brickCount() const { return bricks.size(); }
  [[nodiscard]] std::span<const float> brickValues(std::size_t b) const {
    return {values.data() + b * kBrickVoxels, std::size_t(kBrickVoxels)};
  }
  [[nodiscard]] std::span<float> brickValues(std::size_t b) {
    return {values.data() + b * kBrickVoxels, std::size_t(kBrickVoxels)};
  }
  /// Index coordinates of a brick's first voxel.
  [[nodiscard]] Coord brickCorner(std::size_t b) const { return origin + bricks[b] * kBrickSide; }
};

/// Position of a brick (relative to the volume's origin) in `bricks`; nothing where there is none.
[[nodiscard]] std::optional<std::size_t> findBrick(const SparseVolume& volume, Coord brick);

/// Value at an index coordinate: the background outside the bricks.
[[nodiscard]] float valueAt(const SparseVolume& volume, Coord voxel);

[[nodiscard]] std::uint64_t activeVoxelCount(const SparseVolume& volume);

/// Smallest box around the active voxels, in index coordinates; empty where none is active.
[[nodiscard]] Box activeBox(const SparseVolume& volume);

struct ValueRange {
  float min = 0.0f, max = 0.0f;
};
/// Smallest and largest value over the active voxels. \throws BadInput  no active voxel
[[nodiscard]] ValueRange activeRange(const SparseVolume& volume);

/// Throws std::logic_error where the arrays do not fit each other or the bricks are not in order.
void checkInvariants(const SparseVolume& volume);

/// A single brick on its way into a volume, at any order and place.
struct BrickInput {
  Coord corner;  ///< index coordinates of its first voxel, multiples of 8
  std::array<float, kBrickVoxels> values;
  BrickMask active;
};

/// Builds a volume from bricks in any order: sorts them, drops those without an active voxel and
/// puts the origin at the smallest corner, so that the result does not depend on where the grid
/// lies nor on empty bricks around it. \throws BadInput  two bricks of one corner, or bricks
/// further apart than 2^31 voxels
[[nodiscard]] SparseVolume makeVolume(std::vector<BrickInput> bricks, float background);

}  // namespace esvr
