#pragma once
/// Fills a brick of cells from the bricks of voxels at its corners.

#include <array>
#include <span>

#include "core/cell_corner.h"
#include "esvr/sparse_volume.h"
#include "render/brick_march.h"

namespace esvr {

/// The values of a brick of voxels and of its upper neighbours by the number of the corner; null: a
/// brick of the background.
using CornerBricks = std::array<const float*, kCellCorners>;

/// \param find  find(brick) returns the values of a brick of voxels, or null
template <class Find>
[[nodiscard]] CornerBricks cornerBricks(Coord brick, Find&& find) {
  CornerBricks from;
  for (int c = 0; c < kCellCorners; ++c) from[c] = find(brick + stepToCorner(c));
  return from;
}

/// \param cells  output. \return false if all are the background
bool fillCells(const CornerBricks& from, float background,
               std::span<float, kCellBrickVoxels> cells);

}  // namespace esvr
