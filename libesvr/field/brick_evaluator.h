#pragma once
/// A field made ready for the bricks it is wanted on: the lists are built once, however the bricks
/// are then divided.

#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "field/evaluate_plan.h"

namespace esvr {

class BrickEvaluator {
 public:
  /// \param corners  index corners of the bricks; must outlive the evaluator
  BrickEvaluator(const Field& field, std::span<const Coord> corners);

  /// V on bricks first, first + 1, ... as many as `out` holds, kBrickVoxels each. TBB over bricks.
  void evaluate(std::size_t first, std::span<float> out) const;

 private:
  void evaluateBrick(std::size_t brick, float* sum) const;

  std::span<const Coord> corners_;
  float background_;
  EvaluatePlan plan_;
};

}  // namespace esvr
