#pragma once
/// Numbers bricks of cells, so that a ray finds them by their place (brick_march.h).

#include <vector>

#include "render/brick_march.h"

namespace esvr {

struct BrickTable {
  Coord origin, blocks;  ///< see BrickTableView
  std::vector<std::uint32_t> blockOf, brickOf;
  std::vector<Coord> bricks;  ///< by number: place relative to the origin, in bricks

  [[nodiscard]] BrickTableView view() const {
    return {origin, blocks, blockOf.data(), brickOf.data()};
  }
};

/// Numbers bricks in their order.
/// \param origin  index coordinates of the first voxel of brick (0, 0, 0)
/// \throws UsageError  the bricks lie in a box of more than 2^28 blocks of 64^3 voxels
[[nodiscard]] BrickTable makeBrickTable(std::vector<Coord> bricks, Coord origin);

/// The box of the cells, relative to the table's origin. It is empty without bricks.
[[nodiscard]] PlaceBox cellsOf(const BrickTable& table);

}  // namespace esvr
