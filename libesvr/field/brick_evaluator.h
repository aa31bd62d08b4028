#pragma once
/// Evaluates a field on bricks in several calls. The pair lists are built once for all of them.

#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "field/evaluate_plan.h"

namespace esvr {

class BrickEvaluator {
 public:
  /// \param corners  index corners of the bricks; must outlive the evaluator
  BrickEvaluator(const Field& field, std::span<const Coord> corners);

  /// Evaluates V on the bricks first, first + 1, ..., in parallel.
  /// \param out  kBrickVoxels values for each brick; its size decides how many bricks are evaluated
  void evaluate(std::size_t first, std::span<float> out) const;

 private:
  void evaluateBrick(std::size_t brick, float* sum) const;

  std::span<const Coord> corners_;
  float background_;
  EvaluatePlan plan_;
};

}  // namespace esvr
