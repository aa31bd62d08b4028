#pragma once
/// A field as bricks of cells (brick_march.h) that can be decoded one by one: the bricks, and the
/// ellipsoids that reach each of them.

#include <vector>

#include "esvr/field.h"
#include "esvr/sparse_volume.h"
#include "field/voxel_rule.h"
#include "render/brick_table.h"
#include "render/cell_form.h"

namespace esvr {

struct CellField {
  BrickTable table;                             ///< bricks that supports reach
  std::vector<CellForm> forms;                  ///< by ellipsoid
  std::vector<KernelConstants<float>> kernels;  ///< one for all, or one for each ellipsoid
  std::vector<Coord> origins;                   ///< origins of the chunks
  std::vector<std::uint32_t> begin;             ///< by brick: its entries are [b] to [b + 1] - 1
  std::vector<std::uint32_t> ellipsoid;         ///< by entry
  /// By brick: bit c is set if voxels in the brick of corner c (core/cell_corner.h) may differ from
  /// the background. Empty: all may.
  std::vector<std::uint8_t> corners;
  /// The masks by which voxels are active, or the levels of their thresholds (block_levels.h), and for
  /// each brick and corner the number of those of the voxels there, or BrickIndex::kNone. Otherwise
  /// empty.
  std::vector<BrickMask> masks;
  std::vector<BlockLevels> blockLevels;
  std::vector<std::uint32_t> ruleOf;
  Box box;  ///< no voxel outside it is active
  VoxelRule rule;
};

/// \param voxels  rule by which sums become voxels. If its bricks are restricted, voxels elsewhere
///                are the background
/// \throws MemoryExceeded  as for reachedBricks
/// \throws RuntimeFailure  there are 2^32 pairs of ellipsoids and bricks or more
/// \throws UsageError      as for makeBrickTable
[[nodiscard]] CellField makeCellField(const Field& field, const RevoxeliseOptions& voxels);

}  // namespace esvr
