#include "fit/cpu/sample_voxels.h"

#include <algorithm>

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

}  // namespace

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
  // repeated draws of a voxel are adjacent
  drawn.voxels.erase(std::unique(drawn.voxels.begin(), drawn.voxels.end()), drawn.voxels.end());
  return drawn;
}

}  // namespace esvr
