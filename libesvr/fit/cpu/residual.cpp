#include "fit/cpu/residual.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace esvr {
namespace {

double energy(std::span<const float> values, SignsAllowed signs) {
  double sum = 0.0;
  for (const float r : values) sum += sampleEnergy(r, signs);
  return sum;
}

/// Cumulative energy of the bricks; brick b covers [sums[b], sums[b + 1]).
std::vector<double> energySums(const ResidualField& residual, const SamplingOptions& options) {
  std::vector<double> sums(options.targetBricks + 1, 0.0);
  parallelFor(std::size_t(0), options.targetBricks,
              [&](std::size_t b) { sums[b + 1] = energy(residual.brick(b), options.signs); });
  for (std::size_t b = 0; b < options.targetBricks; ++b) sums[b + 1] += sums[b];
  return sums;
}

/// The voxel at which the cumulative energy exceeds `target`; because of rounding this may be the
/// last voxel with energy.
int voxelAt(std::span<const float> values, SignsAllowed signs, double target) {
  double sum = 0.0;
  int last = 0;
  for (int v = 0; v < kBrickVoxels && sum <= target; ++v) {
    const double e = sampleEnergy(values[v], signs);
    if (e > 0.0) last = v;
    sum += e;
  }
  return last;
}

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

FitErrors errorsOf(const FitTarget& target, const ResidualField& residual) {
  FitErrors errors;
  for (std::size_t b = 0; b < residual.index.size(); ++b) {
    const auto r = residual.brick(b);
    const bool inTarget = b < target.bricks.size();
    const Coord corner = residual.index.bricks()[b] * kBrickSide;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double squared = double(r[v]) * double(r[v]);
      errors.squaredSum += squared;
      if (target.box.contains(corner + voxelLocal(v))) errors.squaredSumBox += squared;
      errors.largest = std::max(errors.largest, std::abs(double(r[v])));
      if (inTarget && (*target.active)[b].test(v)) errors.squaredSumActive += squared;
    }
  }
  return errors;
}

SampledVoxels sampleVoxels(const ResidualField& residual, const SamplingOptions& options) {
  const auto sums = energySums(residual, options);
  SampledVoxels drawn;
  if (!(sums.back() > 0.0)) return drawn;
  drawn.share = sums.back() / double(options.count);
  for (std::size_t n = 0; n < options.count; ++n) {
    const double at = (double(n) + sampleUniform(options.seed, n)) * drawn.share;
    const auto after = std::upper_bound(sums.begin(), sums.end() - 1, at);
    const std::size_t b = std::min(std::size_t(after - sums.begin()), options.targetBricks) - 1;
    const int v = voxelAt(residual.brick(b), options.signs, at - sums[b]);
    if (options.signs.mends(residual.brick(b)[v]) && residual.brick(b)[v] != 0.0f)
      drawn.voxels.push_back(residual.index.bricks()[b] * kBrickSide + voxelLocal(v));
  }
  // Repeated draws of a voxel are adjacent.
  drawn.voxels.erase(std::unique(drawn.voxels.begin(), drawn.voxels.end()), drawn.voxels.end());
  return drawn;
}

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
