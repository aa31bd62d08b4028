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

EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners) {
  const auto reach = supports(field);
  return {gather(field), pairsWithin(BrickIndex(asBricks(corners)), reach.size(),
                                     [&](std::size_t i) -> const Support& { return reach[i]; })};
}

}  // namespace esvr
