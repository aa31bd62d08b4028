#pragma once
/// A volume as bricks of cells, the form in which rays march through it (brick_march.h). A cell is
/// the cube between eight neighbouring voxels.

#include <vector>

#include "esvr/sparse_volume.h"
#include "render/brick_march.h"

namespace esvr {

/// Holds every brick of cells that has a voxel other than the background.
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
