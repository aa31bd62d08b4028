#include "render/lazy_cells.h"

#include <algorithm>

#include "field/active_region.h"
#include "render/cell_bricks.h"
#include "render/cell_corners.h"
#include "render/voxel_levels.h"

namespace esvr {
namespace {

std::vector<Coord> voxelCorners(const Field& field, const RevoxeliseOptions& voxels) {
  std::vector<Coord> reached = reachedBricks(field, voxels.box);
  if (!voxels.restrictToBricks) return reached;
  std::vector<Coord> both;
  std::ranges::set_intersection(reached, voxels.bricks, std::back_inserter(both));
  return both;
}

bool differs(std::span<const float> values, float background) {
  return std::ranges::any_of(values, [&](float v) { return v != background; });
}

}  // namespace

LazyCells::Level::Level(std::span<const Coord> bricks, std::uint32_t firstCells)
    : index(bricks),
      table(makeBrickTable(bricksWithCells(bricks), firstCells)),
      voxels(bricks.size()),
      cells(table.bricks.size()) {}

LazyCells::LazyCells(const Field& field, const RevoxeliseOptions& voxels)
    : field_(field),
      voxels_(voxels),
      rule_(makeVoxelRule(field.background, voxels)),
      corners_(voxelCorners(field, voxels)),
      evaluator_(field_, corners_) {
  levels_.push_back(std::make_unique<Level>(bricksAt(corners_), 0u));
}

void LazyCells::prepare(int lastLevel) {
  while (int(levels_.size()) <= lastLevel) {
    const Level& finer = *levels_.back();
    levels_.push_back(
        std::make_unique<Level>(coarserBricks(finer.index.bricks()),
                                finer.table.first + std::uint32_t(finer.table.bricks.size())));
  }
}

int LazyCells::levelOf(std::uint32_t brick) const {
  int level = int(levels_.size()) - 1;
  while (brick < table(level).first) --level;
  return level;
}

const float* LazyCells::values(std::uint32_t brick) const {
  const int level = levelOf(brick);
  const Level& l = *levels_[std::size_t(level)];
  const std::size_t number = brick - l.table.first;
  return l.cells.get(number, [&](std::span<float, kCellBrickVoxels> values) {
    return fill(level, number, values);
  });
}

/// The voxels of a brick, or null if all of them are the background.
const float* LazyCells::voxelsOf(int level, Coord brick) const {
  const Level& l = *levels_[std::size_t(level)];
  const std::uint32_t number = l.index.find(brick);
  if (number == BrickIndex::kNone) return nullptr;
  return l.voxels.get(number, [&](std::span<float, kBrickVoxels> values) {
    return level == 0 ? decode(number, values) : average(level, brick, values);
  });
}

bool LazyCells::decode(std::uint32_t number, std::span<float, kBrickVoxels> values) const {
  evaluator_.evaluate(number, values);
  (void)settle(rule_, regionIn(voxels_, corners_[number]), values);
  return differs(values, rule_.background);
}

/// Averages the bricks of the next finer level. Those of level 0 are not kept, because a picture that
/// needs their means does not read them again.
bool LazyCells::average(int level, Coord brick, std::span<float, kBrickVoxels> values) const {
  std::ranges::fill(values, rule_.background);
  std::array<float, kBrickVoxels> decoded;
  for (int c = 0; c < kCellCorners; ++c) {
    const Coord finer = brick * 2 + stepToCorner(c);
    if (level > 1) {
      if (const float* const voxels = voxelsOf(level - 1, finer))
        averageInto(std::span<const float, kBrickVoxels>(voxels, kBrickVoxels), c, values);
    } else if (const auto number = levels_[0]->index.find(finer); number != BrickIndex::kNone) {
      if (decode(number, decoded)) averageInto(decoded, c, values);
    }
  }
  return differs(values, rule_.background);
}

bool LazyCells::fill(int level, std::size_t brick,
                     std::span<float, kCellBrickVoxels> values) const {
  const auto find = [&](Coord at) { return voxelsOf(level, at); };
  return fillCells(cornerBricks(table(level).place(brick), find), rule_.background, values);
}

void LazyCells::forget() {
  for (const auto& level : levels_) level->voxels.forget(), level->cells.forget();
}

}  // namespace esvr
