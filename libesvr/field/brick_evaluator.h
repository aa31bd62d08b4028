#pragma once
/// Evaluates a field on bricks in several calls. The pair lists are built once for all of them.

#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "field/brick_pairs.h"
#include "field/gather.h"

namespace esvr {

/// A field that is prepared for evaluation on any bricks.
struct PreparedField {
  explicit PreparedField(const Field& field)
      : gathered(gather(field)), reach(supports(field)), background(field.background) {}

  GatheredField gathered;
  std::vector<Support> reach;  ///< supports of the ellipsoids
  float background;
};

class BrickEvaluator {
 public:
  /// \param field    must outlive the evaluator
  /// \param corners  index corners of the bricks; must outlive the evaluator
  BrickEvaluator(const PreparedField& field, std::span<const Coord> corners);

  /// Evaluates V on the bricks first, first + 1, ..., in parallel.
  /// \param out  kBrickVoxels values for each brick; its size decides how many bricks are evaluated
  void evaluate(std::size_t first, std::span<float> out) const;

 private:
  void evaluateBrick(std::size_t brick, float* sum) const;

  const PreparedField& field_;
  std::span<const Coord> corners_;
  BrickPairs pairs_;
};

}  // namespace esvr
