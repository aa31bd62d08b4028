#pragma once
/// Where voxels may be active, besides the threshold of their values (RevoxeliseOptions, field.h).

#include <span>

#include "esvr/field.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"

namespace esvr {

/// How the voxels of one brick become active.
struct BrickRegion {
  BrickMask within;     ///< no other voxel is active
  bool byValue = true;  ///< true: the rule of values decides about these; false: all are active
  const BlockLevels* levels = nullptr;  ///< levels of the brick's blocks; null: one threshold

  /// \param v  voxelOffset of a voxel, of which `settled` is the value by the rule
  [[nodiscard]] bool isActive(const VoxelRule& rule, int v, float settled) const {
    if (!within.test(v)) return false;
    if (!byValue) return true;
    return levels ? rule.isActive(settled, levels->at(v)) : rule.isActive(settled);
  }
};

/// The voxels of a brick that lie in a box. \param corner  its first voxel
[[nodiscard]] BrickMask maskOf(const Box& box, Coord corner);

/// \param corner  index coordinates of the brick's first voxel
[[nodiscard]] BrickRegion regionIn(const RevoxeliseOptions& options, Coord corner);

/// Turns the sums of one brick into voxels. \return the mask of its active voxels
BrickMask settle(const VoxelRule& rule, const BrickRegion& region, std::span<float> values);

}  // namespace esvr
