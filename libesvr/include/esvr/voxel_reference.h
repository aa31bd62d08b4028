#pragma once
/// Chooses the grids of a file whose voxels are the context of other grids' voxels (VoxelReference),
/// so that they take fewer bytes.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "esvr/container.h"

namespace esvr {

/// Chooses a reference for a grid of voxels. Candidates are compared on a sample of its bricks.
/// \param grids  the grids of a file. Those of `candidates` must be before `grid`, and those among
///               them that hold no voxels are ignored.
/// \return the reference with which the voxels take the fewest bytes of those that were tried, the
///         empty one among them. They may take even fewer without a reference (bytesAdded).
[[nodiscard]] VoxelReference chooseReference(std::span<const StoredGrid> grids, std::size_t grid,
                                             std::span<const std::size_t> candidates);

/// The grid that a reference names, with the values that are expected for the grid that refers to
/// it. As ConvertOptions::previous it makes a conversion choose voxels that take few bytes with this
/// reference.
/// \param grid  refers to the other grid
[[nodiscard]] StoredGrid expectedFrom(std::span<const StoredGrid> grids, std::size_t grid,
                                      const VoxelReference& reference);

}  // namespace esvr
