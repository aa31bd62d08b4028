
#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "field/active_region.h"
#include "field/brick_batches.h"
#include "field/voxel_rule.h"

namespace esvr {
namespace {

Coord smallest(std::span<const Coord> corners) {
  Coord low = corners.front();
  for (const Coord c : corners) low = minCoord(low, c);
  return low;
}

void refuseTooFarApart(Coord low, std::span<const Coord> corners) {
  constexpr std::int64_t kMaxExtent = std::int64_t{Box::kMax} - kBrickSide;
  for (const Coord c : corners) {
    const auto extent =
        std::max({std::int64_t(c.x) - low.x, std::int64_t(c.y) - low.y, std::int64_t(c.z) - low.z});
    if (extent > kMaxExtent)
      throw RuntimeFailure("the ellipsoids reach the voxels " + toString(low) + " and " +
                           toString(c) + ", which are 2^31 voxels or more apart");
  }
}

SparseVolume settledBricks(const Field& field, std::span<const Coord> corners,
                           const RevoxeliseOptions& options) {
  const VoxelRule rule = makeVoxelRule(field.background, options);
  SparseVolume volume;
  volume.background = field.background;
  volume.values = VoxelArray<float>(options.memory);
  if (corners.empty()) return volume;
  volume.origin = smallest(corners);
  refuseTooFarApart(volume.origin, corners);
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
  if (options.restrictToBricks) return settledBricks(field, options.bricks, options);
  return settledBricks(field, reachedBricks(field, options.box), options);
}

}  // namespace esvr
