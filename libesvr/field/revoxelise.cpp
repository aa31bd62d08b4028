/// Converts fields to voxels: the region of each brick in which voxels may be active, its voxels, and the
/// volume of all bricks.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"

namespace esvr {

BrickMask maskOf(const Box& box, Coord corner) {
  const LocalBox local = localBox(box, corner, kBrickSide - 1);
  BrickMask mask;
  for (int x = local.low[0]; x <= local.high[0]; ++x)
    for (int y = local.low[1]; y <= local.high[1]; ++y)
      for (int z = local.low[2]; z <= local.high[2]; ++z) mask.set(voxelOffset({x, y, z}));
  return mask;
}

namespace {

/// The voxels of a brick among those that are always active.
BrickMask alwaysActiveIn(const RevoxeliseOptions& options, Coord corner) {
  BrickMask mask;
  for (const Coord voxel : options.alwaysActive)
    if (brickOf(voxel) == brickOf(corner)) mask.set(voxelOffset(localOf(voxel)));
  return mask;
}

}  // namespace

BrickRegion regionIn(const RevoxeliseOptions& options, Coord corner) {
  const BrickMask inBox = maskOf(options.box, corner);
  if (!options.restrictToBricks) return {inBox, alwaysActiveIn(options, corner)};
  const auto at = std::lower_bound(options.bricks.begin(), options.bricks.end(), corner);
  if (at == options.bricks.end() || *at != corner) return {};
  if (options.masks.empty()) return {inBox, alwaysActiveIn(options, corner)};
  BrickRegion region{inBox, options.masks[std::size_t(at - options.bricks.begin())]};
  for (std::size_t w = 0; w < inBox.words.size(); ++w)
    region.within.words[w] &= region.certain.words[w];
  return region;
}

std::vector<Coord> voxelBricks(const Field& field, const RevoxeliseOptions& options) {
  if (options.restrictToBricks) return {options.bricks.begin(), options.bricks.end()};
  std::vector<Coord> bricks = reachedBricks(field, options.box);
  for (const Coord voxel : options.alwaysActive) {
    if (!options.box.contains(voxel)) continue;
    const Coord corner = voxel - localOf(voxel);
    const auto at = std::ranges::lower_bound(bricks, corner);
    if (at == bricks.end() || *at != corner) bricks.insert(at, corner);
  }
  return bricks;
}

BrickMask settle(const VoxelRule& rule, const BrickRegion& region, std::span<float> values) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v) {
    values[v] = rule.settled(values[v]);
    if (region.isActive(rule, v, values[v]))
      mask.set(v);
    else
      values[v] = rule.inactiveValue(values[v]);
  }
  return mask;
}

namespace {

/// The lowest corner of a box around all bricks.
Coord lowestCorner(std::span<const Coord> corners) {
  constexpr std::int64_t kMaxExtent = std::int64_t{Box::kMax} - kBrickSide;
  Coord low = corners.front();
  for (const Coord c : corners) low = minCoord(low, c);
  for (const Coord c : corners) {
    const auto extent =
        std::max({std::int64_t(c.x) - low.x, std::int64_t(c.y) - low.y, std::int64_t(c.z) - low.z});
    if (extent > kMaxExtent)
      throw RuntimeFailure("the ellipsoids reach the voxels " + toString(low) + " and " +
                           toString(c) + ", which are 2^31 voxels or more apart");
  }
  return low;
}

SparseVolume settledBricks(const Field& field, std::span<const Coord> corners,
                           const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(field.background, options);
  SparseVolume volume;
  volume.background = field.background;
  volume.values = VoxelArray<float>(options.memory);
  if (corners.empty()) return volume;
  volume.origin = lowestCorner(corners);
  std::vector<BrickMask> masks(std::min(kBatchBricks, corners.size()));
  volume.values.reserve(corners.size() * kBrickVoxels);
  forEachBatch(field, corners, [&](const BrickBatch& batch) {
    parallelFor(std::size_t{0}, batch.size(), [&](std::size_t b) {
      masks[b] = settle(rule, regionIn(options, batch.corners[b]), batch.values(b));
    });
    for (std::size_t b = 0; b < batch.size(); ++b) {
      if (masks[b].count() == 0) continue;
      const auto values = batch.values(b);
      volume.bricks.push_back(brickOf(batch.corners[b] - volume.origin));
      volume.active.push_back(masks[b]);
      volume.values.insert(volume.values.end(), values.begin(), values.end());
    }
  });
  dropInactiveBricks(volume);
  return volume;
}

}  // namespace

SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options) {
  return settledBricks(field, voxelBricks(field, options), options);
}

}  // namespace esvr
