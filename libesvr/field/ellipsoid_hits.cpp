
#include <array>

#include "core/parallel.h"
#include "esvr/field.h"
#include "field/evaluate_plan.h"
#include "field/line_math.h"

namespace esvr {
namespace {

using Counts = std::array<std::uint32_t, kBrickVoxels>;

struct EllipsoidHits {
  std::uint64_t voxelPairs = 0;  // pairs of an ellipsoid and a voxel in its support
  std::uint64_t voxels = 0;      // voxels that lie in at least one support
};

/// Adds 1 to every voxel of a brick that lies in an ellipsoid's support.
void addHits(const LineForm& f, const std::array<float, 3>& corner, float cutoff, Counts& counts) {
  const float cx = f.center[0] - corner[0], cy = f.center[1] - corner[1],
              cz = f.center[2] - corner[2];
  for (int x = 0; x < kBrickSide; ++x)
    for (int z = 0; z < kBrickSide; ++z) {
      const float dx = float(x) - cx, dz = float(z) - cz;
      const float pz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
      const float closest = closestSquared(f, dx, pz);
      if (!(closest < cutoff)) continue;
      for (int y = 0; y < kBrickSide; ++y)
        if (squaredAt(f, closest, distanceAlong(f, float(y), cy, dx, dz)) < cutoff)
          ++counts[std::size_t(voxelOffset({x, y, z}))];
    }
}

EllipsoidHits totalOf(const Counts& counts) {
  EllipsoidHits total;
  for (const std::uint32_t count : counts) {
    total.voxelPairs += count;
    total.voxels += count > 0 ? 1 : 0;
  }
  return total;
}

/// Counts the hits of a brick's ellipsoids in its voxels.
EllipsoidHits hitsInBrick(const EvaluatePlan& plan, std::size_t b, Coord brickCorner) {
  Counts counts{};
  for (auto pair = plan.pairs.brickBegin[b]; pair != plan.pairs.brickBegin[b + 1]; ++pair) {
    const std::size_t i = plan.pairs.ellipsoid[pair];
    addHits(plan.field.forms[i], plan.field.fromOrigin(i, brickCorner), plan.field.kernel(i).cutoff,
            counts);
  }
  return totalOf(counts);
}

}  // namespace

double averageHits(const Field& field) {
  const std::vector<Coord> corners = reachedBricks(field);
  const EvaluatePlan plan = planEvaluation(field, corners);
  std::vector<EllipsoidHits> hits(corners.size());
  parallelFor(std::size_t(0), corners.size(),
              [&](std::size_t b) { hits[b] = hitsInBrick(plan, b, corners[b]); });
  EllipsoidHits total;
  for (const EllipsoidHits& h : hits) total.voxelPairs += h.voxelPairs, total.voxels += h.voxels;
  return total.voxels > 0 ? double(total.voxelPairs) / double(total.voxels) : 0.0;
}

}  // namespace esvr
