#pragma once
/// Numbers bricks of cells, so that a ray finds them by their place (brick_march.h).

#include <vector>

#include "render/brick_march.h"

namespace esvr {

struct BrickTable {
  Coord origin, blocks;  ///< see BrickTableView
  std::vector<std::uint32_t> blockOf;
  std::vector<BrickRow> rows;
  std::uint32_t first = 0;    ///< number of the first brick; the others follow
  std::vector<Coord> bricks;  ///< in the order of their numbers: place relative to the origin

  [[nodiscard]] BrickTableView view() const {
    return {origin, blocks, blockOf.data(), rows.data()};
  }
  /// The place of a brick in bricks, not relative to the origin.
  [[nodiscard]] Coord place(std::size_t brick) const { return brickOf(origin) + bricks[brick]; }
};

/// Numbers bricks, block by block.
/// \param bricks  all different
/// \param first   number of the first brick
/// \throws UsageError  the bricks lie in a box of more than 2^28 blocks of 64^3 voxels
[[nodiscard]] BrickTable makeBrickTable(std::vector<Coord> bricks, std::uint32_t first = 0);

/// The places of all bricks, not relative to the origin.
[[nodiscard]] std::vector<Coord> placesOf(const BrickTable& table);

/// The box of the cells, relative to the table's origin. It is empty without bricks.
[[nodiscard]] PlaceBox cellsOf(const BrickTable& table);

}  // namespace esvr
