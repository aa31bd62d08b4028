#pragma once
/// Everything that the evaluation of a field on bricks needs, whatever device does it.

#include <span>

#include "esvr/ellipsoids.h"
#include "field/brick_pairs.h"
#include "field/gather.h"

namespace esvr {

struct EvaluatePlan {
  GatheredField field;
  BrickPairs pairs;  ///< bricks in the order of the corners
};

/// \param corners  index corners, multiples of 8
[[nodiscard]] EvaluatePlan planEvaluation(const Field& field, std::span<const Coord> corners);

}  // namespace esvr
