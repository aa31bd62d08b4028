#include "render/lazy_cells.h"

#include <algorithm>

#include "render/cell_bricks.h"
#include "render/cell_corners.h"

namespace esvr {
namespace {

std::vector<Coord> voxelCorners(const Field& field, const RevoxeliseOptions& voxels) {
  std::vector<Coord> reached = reachedBricks(field);
  if (!voxels.restrictToBricks) return reached;
  std::vector<Coord> both;
  std::ranges::set_intersection(reached, voxels.bricks, std::back_inserter(both));
  return both;
}

std::vector<Coord> bricksAt(const std::vector<Coord>& corners) {
  std::vector<Coord> bricks;
  bricks.reserve(corners.size());
  for (const Coord corner : corners) bricks.push_back(brickOf(corner));
  return bricks;
}

}  // namespace

LazyCells::LazyCells(const Field& field, const RevoxeliseOptions& voxels)
    : field_(field),
      rule_(makeVoxelRule(field.background, voxels)),
      corners_(voxelCorners(field, voxels)),
      evaluator_(field_, corners_),
      index_(bricksAt(corners_)),
      table_(makeBrickTable(bricksWithCells(index_.bricks()), {0, 0, 0})),
      voxels_(corners_.size()),
      cells_(table_.bricks.size()) {}

const float* LazyCells::values(std::uint32_t brick) const {
  return cells_.get(brick,
                    [&](std::span<float, kCellBrickVoxels> values) { return fill(brick, values); });
}

const float* LazyCells::voxelsOf(std::uint32_t brick) const {
  return voxels_.get(brick, [&](std::span<float, kBrickVoxels> values) {
    evaluator_.evaluate(brick, values);
    bool any = false;
    for (float& value : values) {
      value = rule_(value);
      any |= value != rule_.background;
    }
    return any;
  });
}

bool LazyCells::fill(std::uint32_t brick, std::span<float, kCellBrickVoxels> values) const {
  const Coord place = brickOf(table_.origin) + table_.bricks[brick];
  const auto find = [&](Coord at) -> const float* {
    const std::uint32_t number = index_.find(at);
    return number == BrickIndex::kNone ? nullptr : voxelsOf(number);
  };
  return fillCells(cornerBricks(place, find), rule_.background, values);
}

void LazyCells::forget() {
  voxels_.forget();
  cells_.forget();
}

}  // namespace esvr
