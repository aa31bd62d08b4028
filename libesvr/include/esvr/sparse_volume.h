#pragma once
/// A sparse scalar volume: bricks of 8^3 voxels at integer coordinates, and one background value
/// elsewhere. It is the library's only container for voxels; vdb_io.h converts OpenVDB and NanoVDB
/// grids to it and back. Its size depends on the number of bricks and not on the bounding box.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/voxel_memory.h"

namespace esvr {

inline constexpr int kBrickLog2 = 3;
inline constexpr int kBrickSide = 1 << kBrickLog2;                         ///< voxels along an edge
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;  ///< 512

/// Offset of a voxel in its brick: x * 64 + y * 8 + z, as in an OpenVDB leaf.
/// \param local  coordinates in the brick, each 0 to 7
constexpr int voxelOffset(Coord local) { return (local.x << 6) | (local.y << 3) | local.z; }
constexpr Coord voxelLocal(int offset) { return {offset >> 6, (offset >> 3) & 7, offset & 7}; }

/// The brick that contains a voxel (by floor division, also for negative coordinates), and the
/// voxel's coordinates in the brick.
constexpr Coord brickOf(Coord v) {
  return {v.x >> kBrickLog2, v.y >> kBrickLog2, v.z >> kBrickLog2};
}
constexpr Coord localOf(Coord v) {
  return {v.x & (kBrickSide - 1), v.y & (kBrickSide - 1), v.z & (kBrickSide - 1)};
}

/// A bit for each voxel of a brick; word x holds the 64 voxels of slice x, at bit y * 8 + z.
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

/// A volume as a structure of arrays. The bricks are in strictly increasing order of Coord, and the
/// other arrays have entries for each of them.
struct SparseVolume {
  Coord origin;               ///< index coordinates of brick (0,0,0)'s first voxel; multiples of 8
  float background = 0.0f;    ///< value outside the bricks
  std::vector<Coord> bricks;  ///< brick positions relative to `origin`, in bricks, each >= 0
  VoxelArray<float> values;   ///< kBrickVoxels values for each brick, active or not
  std::vector<BrickMask> active;  ///< active voxels of each brick

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

/// The memory that holds a volume's values.
[[nodiscard]] inline VoxelMemory memoryOf(const SparseVolume& volume) {
  return volume.values.get_allocator().memory();
}

/// Index in `bricks` of the brick at a position relative to the volume's origin, if it exists.
[[nodiscard]] std::optional<std::size_t> findBrick(const SparseVolume& volume, Coord brick);

/// Value at an index coordinate, which is the background outside the bricks.
[[nodiscard]] float valueAt(const SparseVolume& volume, Coord voxel);

[[nodiscard]] std::uint64_t activeVoxelCount(const SparseVolume& volume);

/// Bounding box of the active voxels, in index coordinates; empty if there are none.
[[nodiscard]] Box activeBox(const SparseVolume& volume);

struct ValueRange {
  float min = 0.0f, max = 0.0f;

  /// The range of no value, from which a range is expanded.
  [[nodiscard]] static constexpr ValueRange none() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    return {kInfinity, -kInfinity};
  }
  void expand(float v) { expand({v, v}); }
  void expand(const ValueRange& r) {
    min = std::min(min, r.min);
    max = std::max(max, r.max);
  }
};
/// Smallest and largest value of the active voxels.
/// \throws BadInput  there is no active voxel
[[nodiscard]] ValueRange activeRange(const SparseVolume& volume);

/// The interval over which the values of a grid spread, active or not.
struct ValueSpan {
  double low = 0.0, high = 0.0;
  /// True if the background is not in the interval, because it is far from the active values.
  bool farBackground = false;

  [[nodiscard]] double length() const { return high - low; }
};

/// The span of a grid: the interval from the smallest to the largest active value, extended to the
/// background unless that is far. A background is far if it is farther from the interval than the
/// interval is long, as the background 0 of a pressure between 101,325 and 101,365 Pa, or of a
/// temperature between 280 and 310 K. Such a background says only where there is no value, and the
/// values would be lost in a span that contains it. The background of an 8-bit scan whose active
/// values begin at a threshold is not far, nor is that of a grid with one active value.
/// \param active  range of the active values, as from activeRange
[[nodiscard]] ValueSpan spanOf(const ValueRange& active, double background);

/// spanOf() of a volume. \throws BadInput  there is no active voxel
[[nodiscard]] ValueSpan spanOf(const SparseVolume& volume);

/// The peak of the PSNR of a grid, to which its errors are relative. It is
///  - for values of one sign, their range, as in compressors of scientific data. It begins at the
///    background if that lies between 0 and the values and is not far (spanOf). For values from 0 up
///    this is the largest value;
///  - for values of both signs, the largest magnitude. A velocity from -v to v then has the peak v,
///    which does not depend on the direction of the axes, and data of both signs have the quality
///    that those of one sign have;
///  - if all active values are equal, their magnitude, or 1 if they are 0.
/// \param active  range of the active values, as from activeRange
[[nodiscard]] double peakOf(const ValueRange& active, double background);

/// Gives a volume another background, which all inactive voxels get.
void setBackground(float background, SparseVolume& volume);

/// Drops bricks without an active voxel, and moves the origin to the smallest corner of the others.
void dropInactiveBricks(SparseVolume& volume);

/// \throws std::logic_error  the arrays differ in length, or the bricks are not in order
void checkInvariants(const SparseVolume& volume);

/// A brick as input of makeVolume.
struct BrickInput {
  Coord corner;  ///< index coordinates of the first voxel, multiples of 8
  std::array<float, kBrickVoxels> values;
  BrickMask active;
};

/// Builds a volume from bricks in any order. Bricks are sorted, bricks without an active voxel are
/// dropped, and the origin is the smallest corner. A fit therefore does not depend on the position
/// of the grid or on empty bricks around it.
/// \throws BadInput  two bricks have the same corner, or bricks are more than 2^31 voxels apart
[[nodiscard]] SparseVolume makeVolume(std::vector<BrickInput> bricks, float background);

}  // namespace esvr
