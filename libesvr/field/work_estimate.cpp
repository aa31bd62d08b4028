#include "esvr/work_estimate.h"

#include <algorithm>

#include "field/brick_batches.h"
#include "field/brick_walk.h"
#include "field/count_bricks.h"
#include "field/gather.h"

namespace esvr {
namespace {

// Bytes that are held at once, at most. Lists that grow hold twice their content while they are
// copied, and a tree that is written holds a brick again. docs/lab-notes.md, "Memory estimates",
// compares an estimate with what a program held.
constexpr double kEvaluationBytesPerEllipsoid = 512.0;  // parameters, support, prepared form
constexpr double kBytesPerPair = 16.0;  // both lists of pairs, and intermediate lists
constexpr double kBytesOfValues = kBrickVoxels * sizeof(float);
constexpr double kEvaluationBytesPerBrick = 2.0 * (kBytesOfValues + sizeof(BrickMask)) + 96.0;

/// An upper bound that counts a brick once for each ellipsoid that reaches it.
WorkEstimate boundOf(std::span<const Support> supports, const Box& within, double maxOfAll) {
  WorkEstimate bound{.ellipsoids = double(supports.size())};
  Box all;
  for (const Support& support : supports) {
    const Box range = common(brickRange(support), within);
    if (range.empty()) continue;
    bound.pairs += std::min(maxBricks(support, within), maxOfAll);
    all.expand(range);
  }
  bound.bricks = std::min({bound.pairs, all.volume(), maxOfAll});
  return bound;
}

}  // namespace

double WorkEstimate::bytes() const {
  return ellipsoids * kEvaluationBytesPerEllipsoid + pairs * kBytesPerPair +
         bricks * kEvaluationBytesPerBrick +
         std::min(bricks, double(kBatchBricks)) * kBytesOfValues;
}

WorkEstimate estimateWork(const Field& field, const EstimateOptions& options) {
  const auto reach = supports(field);
  const Box within = bricksOf(options.within);
  WorkEstimate estimate = boundOf(reach, within, options.maxBricks);
  WorkEstimate withoutBricks = estimate;
  withoutBricks.bricks = 0.0;
  const double left = options.enough - withoutBricks.bytes();
  if (estimate.bytes() <= options.enough || !(left > 0.0)) return estimate;
  const double counted = countBricks(reach, within, left / kEvaluationBytesPerBrick);
  if (counted <= left / kEvaluationBytesPerBrick)
    estimate.bricks = std::min(estimate.bricks, counted);
  return estimate;
}

}  // namespace esvr
