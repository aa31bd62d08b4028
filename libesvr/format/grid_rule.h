#pragma once
/// The rule that determines the voxels of a stored grid from its sum of ellipsoids, and the voxels of some bricks of a grid, so
/// that a volume which is larger than the memory can be looked at piece by piece.

#include <limits>
#include <span>
#include <vector>

#include "esvr/container.h"
#include "esvr/grid_coding.h"
#include "field/voxel_rule.h"

namespace esvr::format {

/// A threshold below every activity.
inline constexpr float kAlwaysActive = -std::numeric_limits<float>::max();

[[nodiscard]] VoxelRule ruleOf(const StoredGrid& grid);

/// Index corners, increasing, of the bricks in which decodeGrid() may return an active voxel.
/// \throws MemoryExceeded  as for reachedBricks (field.h)
[[nodiscard]] std::vector<Coord> decodedBricks(const StoredGrid& grid,
                                               const DecodeOptions& options);

/// The voxels of decodeGrid() in these bricks; `options.maxBytes` is ignored.
/// \param bricks  increasing corners
/// \throws UsageError  as for decodeGrid
[[nodiscard]] SparseVolume decodeBricks(const StoredGrid& grid, const DecodeOptions& options,
                                        std::span<const Coord> bricks);

}  // namespace esvr::format
