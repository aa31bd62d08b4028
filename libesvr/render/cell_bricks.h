#pragma once
/// The bricks of a volume's cells. A cell is the cube between a voxel and its neighbours above
/// along x, y and z; it belongs to the brick of that voxel.

#include <vector>

#include "esvr/sparse_volume.h"

namespace esvr {

/// Corners of a cell are numbered: 4 where the corner lies above along x, plus 2 along y, plus 1
/// along z. The step from the lowest corner is that from a brick to its neighbour, too.
[[nodiscard]] inline Coord stepToCorner(int corner) {
  return {corner >> 2, (corner >> 1) & 1, corner & 1};
}
[[nodiscard]] inline std::size_t cornerAt(Coord step) {
  return std::size_t(step.x << 2 | step.y << 1 | step.z);
}

/// Bricks of which a cell has a corner in a brick of the volume, in increasing order.
[[nodiscard]] std::vector<Coord> bricksWithCells(const SparseVolume& volume);

}  // namespace esvr
