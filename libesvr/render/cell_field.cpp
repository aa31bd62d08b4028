#include "render/cell_field.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/cell_corner.h"
#include "field/brick_pairs.h"
#include "field/count_bricks.h"
#include "field/gather.h"
#include "render/cell_bricks.h"

namespace esvr {
namespace {

/// The cells of a brick have 9 voxels along an axis instead of 8. In a frame that is moved by half
/// a voxel, this is a support that is half a voxel wider.
Support reachOfCells(const Support& s) {
  constexpr double kHalf = 0.5;
  return makeSupport({s.center[0] - kHalf, s.center[1] - kHalf, s.center[2] - kHalf}, s.L, s.radius,
                     s.slack + kHalf);
}

std::vector<CellForm> formsOf(const GatheredField& field, const std::vector<Support>& reach) {
  std::vector<CellForm> forms;
  forms.reserve(reach.size());
  for (std::size_t i = 0; i < reach.size(); ++i)
    forms.push_back({field.forms[i], float(reach[i].half[2]), field.chunkOf[i]});
  return forms;
}

/// Bit c is set if the brick of corner c is one of the given bricks.
std::uint8_t cornersIn(const BrickIndex& given, Coord brick) {
  unsigned bits = 0;
  for (int c = 0; c < kCellCorners; ++c)
    if (given.find(brick + stepToCorner(c)) != BrickIndex::kNone) bits |= 1u << c;
  return std::uint8_t(bits);
}

/// The bricks of cells of which a corner lies in a given brick of voxels.
std::vector<Coord> withCornersIn(const BrickIndex& given, const std::vector<Coord>& bricks) {
  std::vector<Coord> kept;
  std::ranges::copy_if(bricks, std::back_inserter(kept),
                       [&](Coord brick) { return cornersIn(given, brick) != 0; });
  return kept;
}

/// The bricks of cells of which a corner may lie in a box of voxels.
Box cellBricksOf(const Box& voxels) {
  const Box bricks = bricksOf(voxels);
  return voxels.empty() ? voxels : Box{bricks.min - Coord{1, 1, 1}, bricks.max};
}

/// Finds the masks or the levels of the voxels at the corners of the bricks.
void numberRules(CellField& cells, const BrickIndex& given, const RevoxeliseOptions& voxels) {
  cells.masks.assign(voxels.masks.begin(), voxels.masks.end());
  cells.blockLevels.assign(voxels.levels.begin(), voxels.levels.end());
  if (cells.masks.empty() && cells.blockLevels.empty()) return;
  for (std::size_t i = 0; i < cells.table.bricks.size(); ++i)
    for (int c = 0; c < kCellCorners; ++c)
      cells.ruleOf.push_back(given.find(cells.table.place(i) + stepToCorner(c)));
}

/// Numbers the bricks that supports reach.
void numberBricks(CellField& cells, std::vector<Coord> reached, const RevoxeliseOptions& voxels) {
  const BrickIndex given(bricksAt(voxels.bricks));
  if (voxels.restrictToBricks) reached = withCornersIn(given, reached);
  cells.table = makeBrickTable(std::move(reached));
  if (!voxels.restrictToBricks) return;
  for (std::size_t i = 0; i < cells.table.bricks.size(); ++i)
    cells.corners.push_back(cornersIn(given, cells.table.place(i)));
  numberRules(cells, given, voxels);
}

}  // namespace

CellField makeCellField(const Field& field, const RevoxeliseOptions& voxels) {
  GatheredField gathered = gather(field);
  std::vector<Support> reach = supports(field);
  CellField cells;
  cells.forms = formsOf(gathered, reach);
  std::ranges::transform(reach, reach.begin(), reachOfCells);
  requireListable(reach, bricksOf(Box::whole()));
  const SupportOf supportOf = [&](std::size_t i) { return reach[i]; };
  numberBricks(cells,
               missingBricks(BrickIndex(std::span<const Coord>{}), reach.size(), supportOf,
                             cellBricksOf(voxels.box)),
               voxels);
  BrickPairs pairs = pairsWithin(BrickIndex(placesOf(cells.table)), reach.size(), supportOf);
  cells.begin = std::move(pairs.brickBegin);
  cells.ellipsoid = std::move(pairs.ellipsoid);
  cells.kernels = std::move(gathered.kernels);
  cells.origins = std::move(gathered.origins);
  cells.box = voxels.box;
  cells.rule = makeVoxelRule(field.background, voxels);
  return cells;
}

}  // namespace esvr
