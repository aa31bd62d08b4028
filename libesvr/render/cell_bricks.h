#pragma once
/// The bricks of the cells of a volume. A cell is the cube between a voxel and its neighbours above
/// along x, y and z; it belongs to the brick of that voxel.

#include <span>
#include <vector>

#include "esvr/coord.h"

namespace esvr {

/// The bricks whose first voxels are given.
[[nodiscard]] std::vector<Coord> bricksAt(std::span<const Coord> corners);

/// The bricks of the next coarser level that these bricks belong to, in
/// increasing order.
[[nodiscard]] std::vector<Coord> coarserBricks(std::span<const Coord> bricks);

/// Bricks of which a cell has a corner in one of the bricks of voxels, in increasing order.
/// \param voxels  in increasing order
[[nodiscard]] std::vector<Coord> bricksWithCells(std::span<const Coord> voxels);

}  // namespace esvr
