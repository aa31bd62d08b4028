#pragma once
/// Thresholds of activity that differ from block to block. A sum of ellipsoids is near its source by
/// a different amount in each place, so that the active voxels follow from its values more precisely
/// with several thresholds than with one, and take far fewer bytes than a mask.

#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/kernel.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Voxels along an axis of a block.
inline constexpr int kBlockVoxels = 4;
/// Blocks along an axis of a brick, and in a brick.
inline constexpr int kBlocksAlong = kBrickSide / kBlockVoxels;
inline constexpr int kBlocksOfBrick = kBlocksAlong * kBlocksAlong * kBlocksAlong;

/// Number of levels, and of levels by which a threshold doubles.
inline constexpr int kLevelCount = 48, kLevelsOfOctave = 4;

/// The level in the middle. A writer gives it the threshold that suits the whole grid best.
inline constexpr int kMiddleLevel = kLevelCount / 2;

/// The block of a voxel of a brick. \param voxel  its voxelOffset
[[nodiscard]] ESVR_HD constexpr int blockOf(int voxel) {
  constexpr int kHalf = kBlockVoxels, kRow = kBrickSide, kSlice = kBrickSide * kBrickSide;
  return (voxel / kSlice / kHalf * kBlocksAlong + voxel / kRow % kRow / kHalf) * kBlocksAlong +
         voxel % kRow / kHalf;
}

/// The threshold of a level, base * 2^(level / 4), rounded to float32.
/// \param base   threshold of level 0, above 0
/// \param level  from 0 to kLevelCount - 1
[[nodiscard]] ESVR_HD inline float thresholdAt(float base, int level) {
  constexpr float kRoots[kLevelsOfOctave] = {1.0f, 1.18920711f, 1.41421356f, 1.68179283f};
  return std::ldexp(base * kRoots[level % kLevelsOfOctave], level / kLevelsOfOctave);
}

/// The levels of the blocks of a brick, in the order of blockOf().
struct BlockLevels {
  std::array<std::uint8_t, kBlocksOfBrick> of{};

  [[nodiscard]] ESVR_HD int at(int voxel) const { return of[blockOf(voxel)]; }
  friend bool operator==(const BlockLevels&, const BlockLevels&) = default;
};

}  // namespace esvr
