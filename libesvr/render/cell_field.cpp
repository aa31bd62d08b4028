#include "render/cell_field.h"

#include <algorithm>
#include <utility>

#include "core/cell_corner.h"
#include "field/brick_pairs.h"
#include "field/count_bricks.h"
#include "field/gather.h"

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

/// The bricks whose voxels are not all outside the given ones, and their corners.
struct Restricted {
  std::vector<Coord> bricks;
  std::vector<std::uint8_t> corners;
};
Restricted restrictedTo(std::span<const Coord> givenCorners, const std::vector<Coord>& reached) {
  std::vector<Coord> given;
  for (const Coord corner : givenCorners) given.push_back(brickOf(corner));
  const BrickIndex index(given);
  Restricted kept;
  for (const Coord brick : reached)
    if (const std::uint8_t corners = cornersIn(index, brick); corners != 0) {
      kept.bricks.push_back(brick);
      kept.corners.push_back(corners);
    }
  return kept;
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
  Restricted bricks{missingBricks(BrickIndex(std::span<const Coord>{}), reach.size(), supportOf),
                    {}};
  if (voxels.restrictToBricks) bricks = restrictedTo(voxels.bricks, bricks.bricks);
  BrickPairs pairs = pairsWithin(BrickIndex(bricks.bricks), reach.size(), supportOf);
  cells.begin = std::move(pairs.brickBegin);
  cells.ellipsoid = std::move(pairs.ellipsoid);
  cells.corners = std::move(bricks.corners);
  cells.table = makeBrickTable(std::move(bricks.bricks), {0, 0, 0});
  cells.kernels = std::move(gathered.kernels);
  cells.origins = std::move(gathered.origins);
  cells.rule = makeVoxelRule(field.background, voxels);
  return cells;
}

}  // namespace esvr
