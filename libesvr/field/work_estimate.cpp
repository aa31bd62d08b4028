#include "esvr/field.h"

#include <algorithm>

#include "field/brick_pairs.h"
#include "field/evaluate.h"

namespace esvr {
namespace {

// Bytes that are held at once, at most. Lists that grow hold twice their content while they are
// copied, and a tree that is written holds a brick again. docs/lab-notes.md, "Memory estimates",
// compares an estimate with what a program held.
constexpr double kEvaluationBytesPerEllipsoid = 512.0;  // parameters, support, prepared form
constexpr double kBytesPerPair = 16.0;  // both lists of pairs, and intermediate lists
/// Pairs that are not listed at the same time take time only. They count a little, so that a limit
/// on the memory also limits the time that a hostile file may take.
constexpr double kBytesPerFurtherPair = 1.0;
constexpr double kBytesOfValues = kBrickVoxels * sizeof(float);
/// Bytes that a brick takes without its values.
constexpr double kBytesPerEntry = 2.0 * sizeof(BrickMask) + 96.0;

/// Bytes of an evaluated brick in memory.
double bytesPerBrick(double bricks, const VoxelMemory& memory) {
  const bool isInFile = memory.isInFile(std::uint64_t(std::min(bricks * kBytesOfValues, 0x1p63)));
  return kBytesPerEntry + (isInFile ? 0.0 : 2.0 * kBytesOfValues);
}

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

double WorkEstimate::bytes(const VoxelMemory& memory) const {
  const double listed = std::min(pairs, std::max(kMaxListedPairs, ellipsoids));
  return ellipsoids * kEvaluationBytesPerEllipsoid + listed * kBytesPerPair +
         (pairs - listed) * kBytesPerFurtherPair + bricks * bytesPerBrick(bricks, memory) +
         std::min(bricks, double(kBatchBricks)) * kBytesOfValues;
}

WorkEstimate estimateWork(const Field& field, const EstimateOptions& options) {
  const auto reach = supports(field);
  const Box within = bricksOf(options.within);
  WorkEstimate estimate = boundOf(reach, within, options.maxBricks);
  WorkEstimate withoutBricks = estimate;
  withoutBricks.bricks = 0.0;
  const double left = options.enough - withoutBricks.bytes();
  if (estimate.bytes(options.memory) <= options.enough || !(left > 0.0)) return estimate;
  const double most = left / bytesPerBrick(estimate.bricks, options.memory);
  const double counted = countBricks(reach, within, most);
  if (counted <= most) estimate.bricks = std::min(estimate.bricks, counted);
  return estimate;
}

}  // namespace esvr
