#include <string>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/brick_evaluator.h"
#include "field/count_bricks.h"

namespace esvr {
namespace {

/// Largest number of bricks that are listed, which takes 48 GiB.
constexpr double kMaxListed = 0x1p32;

void requireListable(const std::vector<Support>& reach, const Box& within) {
  double bricks = 0.0;
  for (const Support& support : reach) bricks += maxBricks(support, within);
  if (bricks > kMaxListed)
    throw MemoryExceeded("the ellipsoids reach up to " + std::to_string(bricks) +
                         " bricks, more than 2^32");
}

}  // namespace

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
