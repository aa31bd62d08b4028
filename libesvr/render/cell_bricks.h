#pragma once
/// The bricks of the cells of a volume. A cell is the cube between a voxel and its neighbours above
/// along x, y and z; it belongs to the brick of that voxel.

#include <span>
#include <vector>

#include "esvr/coord.h"

namespace esvr {

/// Bricks of which a cell has a corner in one of the bricks of voxels, in increasing order.
/// \param voxels  in increasing order
[[nodiscard]] std::vector<Coord> bricksWithCells(std::span<const Coord> voxels);

}  // namespace esvr
