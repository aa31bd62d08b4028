#include <algorithm>

#include "esvr/field.h"
#include "field/brick_batches.h"
#include "field/voxel_rule.h"

namespace esvr {
namespace {

/// Turns the sums of one brick into voxels. \return its active voxels
BrickMask settle(const VoxelRule& rule, std::span<float> values) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) {
    values[v] = rule.settled(values[v]);
    if (rule.isActive(values[v]))
      mask.set(v);
    else
      values[v] = rule.inactiveValue(values[v]);
  }
  return mask;
}

Coord smallest(std::span<const Coord> corners) {
  Coord low = corners.front();
  for (const Coord c : corners) low = minCoord(low, c);
  return low;
}

/// Moves the origin to the smallest corner that is left, as makeVolume would have it.
void tightenOrigin(SparseVolume& volume) {
  if (volume.bricks.empty()) {
    volume.origin = {};
    return;
  }
  const Coord low = smallest(volume.bricks);
  for (Coord& b : volume.bricks) b = b - low;
  volume.origin = volume.origin + low * kBrickSide;
}

SparseVolume settledBricks(const Field& field, std::span<const Coord> corners,
                           const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(field.background, options);
  SparseVolume volume;
  volume.background = field.background;
  if (corners.empty()) return volume;
  volume.origin = smallest(corners);
  forEachBrick(field, corners, [&](Coord corner, std::span<float> values) {
    const BrickMask mask = settle(rule, values);
    if (mask.count() == 0) return;
    volume.bricks.push_back(brickOf(corner - volume.origin));
    volume.active.push_back(mask);
    volume.values.insert(volume.values.end(), values.begin(), values.end());
  });
  tightenOrigin(volume);
  return volume;
}

}  // namespace

SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options) {
  if (options.restrictToBricks) return settledBricks(field, options.bricks, options);
  return settledBricks(field, reachedBricks(field), options);
}

}  // namespace esvr
