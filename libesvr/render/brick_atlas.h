#pragma once
/// Voxels as bricks of cells, ready to be marched (brick_march.h).

#include <vector>

#include "esvr/sparse_volume.h"
#include "render/brick_march.h"

namespace esvr {

/// A brick of cells is there where any of its cells has a corner that is not the background.
struct BrickAtlas {
  Coord origin, blocks;
  std::vector<std::uint32_t> blockOf, brickOf;
  std::vector<Coord> bricks;  ///< relative to the origin, in bricks; in the order of `values`
  std::vector<float> values;

  [[nodiscard]] BrickAtlasView view() const {
    return {origin, blocks, blockOf.data(), brickOf.data(), values.data()};
  }
};

[[nodiscard]] BrickAtlas makeBrickAtlas(const SparseVolume& volume);

/// The box of an atlas' cells, relative to its origin. It is empty for an atlas without bricks.
[[nodiscard]] PlaceBox cellsOf(const BrickAtlas& atlas);

}  // namespace esvr
