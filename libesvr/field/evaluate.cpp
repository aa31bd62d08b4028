#include "esvr/field.h"
#include "field/brick_evaluator.h"
#include "field/count_bricks.h"

namespace esvr {

std::vector<Coord> reachedBricks(const Field& field, const Box& within) {
  const auto reach = supports(field);
  requireListable(reach, bricksOf(within));
  auto bricks = missingBricks(
      BrickIndex({}), reach.size(), [&](std::size_t i) -> const Support& { return reach[i]; },
      bricksOf(within));
  for (Coord& b : bricks) b = b * kBrickSide;
  return bricks;
}

void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out) {
  const PreparedField prepared(field);
  BrickEvaluator(prepared, corners).evaluate(0, out);
}

}  // namespace esvr
