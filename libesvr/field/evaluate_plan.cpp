#include "field/evaluate_plan.h"

namespace esvr {
namespace {

std::vector<Coord> asBricks(std::span<const Coord> corners) {
  std::vector<Coord> bricks;
  bricks.reserve(corners.size());
  for (const Coord c : corners) bricks.push_back(brickOf(c));
  return bricks;
}

}  // namespace

BrickPairs pairsWith(std::span<const Support> reach, std::span<const Coord> corners) {
  return pairsWithin(BrickIndex(asBricks(corners)), reach.size(),
                     [&](std::size_t i) -> const Support& { return reach[i]; });
}

EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners) {
  return {gather(field), pairsWith(supports(field), corners)};
}

}  // namespace esvr
