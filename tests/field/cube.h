#pragma once
/// Bricks to evaluate on.

#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr::test {

/// Corners of bricks^3 bricks, from `corner` on.
inline std::vector<Coord> cube(Coord corner, int bricks) {
  std::vector<Coord> corners;
  for (int x = 0; x < bricks; ++x)
    for (int y = 0; y < bricks; ++y)
      for (int z = 0; z < bricks; ++z) corners.push_back(corner + Coord{x, y, z} * kBrickSide);
  return corners;
}

}  // namespace esvr::test
