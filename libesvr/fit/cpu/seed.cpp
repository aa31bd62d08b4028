#include "fit/cpu/seed.h"

#include "core/parallel.h"
#include "fit/seed_math.h"

namespace esvr {
namespace {

SeedMoments momentsAround(const ResidualField& residual, Coord voxel, double sign, int w) {
  SeedMoments m;
  for (int x = -w; x <= w; ++x)
    for (int y = -w; y <= w; ++y)
      for (int z = -w; z <= w; ++z) {
        if (!inSeedWindow({x, y, z}, w)) continue;
        const double r = sign * residual.at(voxel + Coord{x, y, z});
        if (r > 0.0) m.add({x, y, z}, r);
      }
  return m;
}

Ellipsoid seedAt(const ResidualField& residual, Coord voxel, const SeedOptions& options,
                 double share) {
  const double r = residual.at(voxel);
  const auto moments = momentsAround(residual, voxel, r < 0.0 ? -1.0 : 1.0, options.window);
  return seedFromMoments(voxel, r, moments, {options.unitVariance, options.intensity, share});
}

}  // namespace

std::vector<Ellipsoid> seedsFromResidual(const ResidualField& residual,
                                         const SeedOptions& options) {
  const auto [voxels, share] = sampleVoxels(residual, options.draw);
  std::vector<Ellipsoid> seeds(voxels.size());
  parallelFor(std::size_t(0), seeds.size(), [&, &at = voxels, each = share](std::size_t i) {
    seeds[i] = seedAt(residual, at[i], options, each);
  });
  return seeds;
}

}  // namespace esvr
