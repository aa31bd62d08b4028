#pragma once
/// Makes cubes of bricks for tests.

#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr::test {

/// Corners of a cube of bricks^3 bricks, beginning at `corner`.
inline std::vector<Coord> cube(Coord corner, int bricks) {
  std::vector<Coord> corners;
  for (int x = 0; x < bricks; ++x)
    for (int y = 0; y < bricks; ++y)
      for (int z = 0; z < bricks; ++z) corners.push_back(corner + Coord{x, y, z} * kBrickSide);
  return corners;
}

}  // namespace esvr::test
