#include "render/cell_corners.h"

#include <algorithm>

namespace esvr {
namespace {

/// Copies the part of the cells whose voxels lie in one brick of voxels.
void copyCorner(const float* from, Coord corner, std::span<float, kCellBrickVoxels> cells) {
  const auto last = [](int step) { return step == 0 ? kBrickSide : 1; };
  for (int x = 0; x < last(corner.x); ++x)
    for (int y = 0; y < last(corner.y); ++y) {
      const float* const row = from + voxelOffset({x, y, 0});
      const Coord to{x + corner.x * kBrickSide, y + corner.y * kBrickSide, corner.z * kBrickSide};
      std::copy_n(row, last(corner.z),
                  &cells[std::size_t((to.x * kCellBrickSide + to.y) * kCellBrickSide + to.z)]);
    }
}

}  // namespace

bool fillCells(const CornerBricks& from, float background,
               std::span<float, kCellBrickVoxels> cells) {
  if (std::ranges::all_of(from, [](const float* brick) { return brick == nullptr; })) return false;
  std::ranges::fill(cells, background);
  for (int c = 0; c < kCellCorners; ++c)
    if (from[c] != nullptr) copyCorner(from[c], stepToCorner(c), cells);
  return std::ranges::any_of(cells, [&](float v) { return v != background; });
}

}  // namespace esvr
