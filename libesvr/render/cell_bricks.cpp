#include "render/cell_bricks.h"

#include <algorithm>

namespace esvr {

std::vector<Coord> bricksWithCells(const SparseVolume& volume) {
  std::vector<Coord> bricks;
  bricks.reserve(8 * volume.bricks.size());
  for (const Coord brick : volume.bricks)
    for (int corner = 0; corner < 8; ++corner) bricks.push_back(brick - stepToCorner(corner));
  std::sort(bricks.begin(), bricks.end());
  bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
  return bricks;
}

}  // namespace esvr
