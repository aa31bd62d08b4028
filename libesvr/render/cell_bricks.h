#pragma once
/// The bricks of a volume's cells. A cell is the cube between a voxel and its neighbours above
/// along x, y and z; it belongs to the brick of that voxel.

#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

/// Bricks of which a cell has a corner in a brick of the volume, in increasing order.
[[nodiscard]] std::vector<Coord> bricksWithCells(const SparseVolume& volume);

}  // namespace esvr
