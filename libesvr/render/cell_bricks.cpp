#include "render/cell_bricks.h"

#include <algorithm>

#include "core/cell_corner.h"

namespace esvr {

std::vector<Coord> bricksWithCells(std::span<const Coord> voxels) {
  std::vector<Coord> bricks;
  bricks.reserve(kCellCorners * voxels.size());
  for (const Coord brick : voxels)
    for (int corner = 0; corner < kCellCorners; ++corner)
      bricks.push_back(brick - stepToCorner(corner));
  std::sort(bricks.begin(), bricks.end());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

}  // namespace esvr
