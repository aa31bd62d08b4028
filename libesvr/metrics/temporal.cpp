#include <algorithm>

#include "esvr/error.h"
#include "esvr/temporal_metrics.h"
#include "metrics/brick_pairs.h"

namespace esvr {
namespace {

using metrics::BrickPair;
using metrics::PairValues;

Coord smallestBrick(const std::vector<BrickPair>& pairs) {
  Coord smallest = pairs.empty() ? Coord{} : pairs.front().brick;
  for (const BrickPair& pair : pairs) smallest = minCoord(smallest, pair.brick);
  return smallest;
}

BrickMask activeInEither(const PairValues& values) {
  BrickMask active;
  for (int offset = 0; offset < kBrickVoxels; ++offset)
    if (values.referenceActive(offset) || values.candidateActive(offset)) active.set(offset);
  return active;
}

bool isEmpty(const FramePair& frames) {
  return activeVoxelCount(frames.before) == 0 && activeVoxelCount(frames.after) == 0;
}

/// The peak of a volume; 0 if it has no active voxel.
double peakOrZero(const SparseVolume& volume) {
  return activeVoxelCount(volume) == 0 ? 0.0 : peakOf(volume);
}

}  // namespace

SparseVolume temporalDifference(const FramePair& frames) {
  const auto pairs = metrics::pairBricks(frames.before, frames.after);
  const Coord first = smallestBrick(pairs);
  SparseVolume change;
  change.values = VoxelArray<float>(memoryOf(frames.after));
  change.origin = first * kBrickSide;
  change.background = frames.after.background - frames.before.background;
  change.values.resize(pairs.size() * kBrickVoxels);
  for (std::size_t b = 0; b < pairs.size(); ++b) {
    const PairValues values(pairs[b]);
    change.bricks.push_back(pairs[b].brick - first);
    change.active.push_back(activeInEither(values));
    const auto out = change.brickValues(b);
    for (int offset = 0; offset < kBrickVoxels; ++offset)
      out[std::size_t(offset)] = float(values.candidate(offset) - values.reference(offset));
  }
  return change;
}

double temporalPsnr(const FramePair& reference, const FramePair& candidate,
                    const CompareOptions& options) {
  if (isEmpty(reference)) throw BadInput("the reference has no active voxel in two frames");
  const SparseVolume expected = temporalDifference(reference);
  CompareOptions own = options;
  if (!own.box) own.box = activeBox(expected);
  if (!own.peak) own.peak = std::max(peakOrZero(reference.before), peakOrZero(reference.after));
  return psnrOverBox(expected, temporalDifference(candidate), own);
}

}  // namespace esvr
