#pragma once
/// The data that the evaluation of a field on bricks needs on any device.

#include <span>

#include "esvr/ellipsoids.h"
#include "field/brick_pairs.h"
#include "field/gather.h"

namespace esvr {

struct EvaluatePlan {
  GatheredField field;
  BrickPairs pairs;  ///< pairs with the bricks, which are in the order of the corners
};

/// The pairs of supports and bricks.
/// \param corners  index corners of the bricks, multiples of 8
[[nodiscard]] BrickPairs pairsWith(std::span<const Support> reach, std::span<const Coord> corners);

/// \param corners  index corners of the bricks, multiples of 8
[[nodiscard]] EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners);

}  // namespace esvr
