#include "esvr/field.h"
#include "field/brick_evaluator.h"

namespace esvr {

std::vector<Coord> reachedBricks(const Field& field) {
  const auto reach = supports(field);
  auto bricks = missingBricks(BrickIndex({}), reach.size(),
                              [&](std::size_t i) -> const Support& { return reach[i]; });
  for (Coord& b : bricks) b = b * kBrickSide;
  return bricks;
}

void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out) {
  BrickEvaluator(field, corners).evaluate(0, out);
}

}  // namespace esvr
