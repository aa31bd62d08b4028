#include "fit/cpu/residual.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "core/parallel.h"

namespace esvr {
namespace {

constexpr int kSumLanes = 8;  // of each sum, so that the compiler uses SIMD

/// The sum of sampleEnergy() over values whose number is a multiple of kSumLanes.
double energy(std::span<const float> values, SignsAllowed signs) {
  const float below = signs.positive ? 1.0f : 0.0f, above = signs.negative ? 1.0f : 0.0f;
  double part[kSumLanes] = {};
  for (std::size_t v = 0; v < values.size(); v += kSumLanes)
    for (std::size_t l = 0; l < kSumLanes; ++l) {
      const float r = values[v + l];
      const auto kept = double(r * (r < 0.0f ? below : above));
      part[l] += kept * kept;
    }
  return std::accumulate(std::begin(part), std::end(part), 0.0);
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

/// Squares of 64 residuals, of which `counted` names some.
struct WordErrors {
  double all, counted;
};
WordErrors errorsOfWord(const float* r, std::uint64_t counted) {
  double part[kSumLanes] = {}, counts[kSumLanes] = {};
  for (int v = 0; v < 64; v += kSumLanes)
    for (int l = 0; l < kSumLanes; ++l) part[l] += double(r[v + l]) * double(r[v + l]);
  const double all = std::accumulate(std::begin(part), std::end(part), 0.0);
  if (counted == 0) return {all, 0.0};
  if (counted == ~std::uint64_t{0}) return {all, all};
  for (int v = 0; v < 64; ++v)
    counts[v % kSumLanes] += (counted >> v & 1) ? double(r[v]) * double(r[v]) : 0.0;
  return {all, std::accumulate(std::begin(counts), std::end(counts), 0.0)};
}

float largestOf(std::span<const float> values) {
  float part[kSumLanes] = {};
  for (std::size_t v = 0; v < values.size(); v += kSumLanes)
    for (std::size_t l = 0; l < kSumLanes; ++l)
      part[l] = std::max(part[l], std::abs(values[v + l]));
  return *std::max_element(std::begin(part), std::end(part));
}

/// The voxels of a brick that lie in a box.
BrickMask voxelsIn(const Box& box, Coord corner) {
  BrickMask mask;
  for (int v = 0; v < kBrickVoxels; ++v)
    if (box.contains(corner + voxelLocal(v))) mask.set(v);
  return mask;
}

FitErrors errorsOfBrick(const FitTarget& target, const ResidualField& residual, std::size_t b) {
  constexpr std::int32_t kLast = kBrickSide - 1;
  const auto r = residual.brick(b);
  const Coord corner = residual.index.bricks()[b] * kBrickSide;
  const bool inBox =
      target.box.contains(corner) && target.box.contains(corner + Coord{kLast, kLast, kLast});
  const BrickMask box = inBox ? BrickMask{} : voxelsIn(target.box, corner);
  const BrickMask active = b < target.bricks.size() ? (*target.active)[b] : BrickMask{};
  FitErrors errors;
  errors.largest = double(largestOf(r));
  for (std::size_t word = 0; word < active.words.size(); ++word) {
    const float* const values = r.data() + word * 64;
    const WordErrors sums = errorsOfWord(values, active.words[word]);
    errors.squaredSum += sums.all;
    errors.squaredSumActive += sums.counted;
    errors.squaredSumBox += inBox ? sums.all : errorsOfWord(values, box.words[word]).counted;
  }
  return errors;
}

}  // namespace

FitErrors errorsOf(const FitTarget& target, const ResidualField& residual) {
  std::vector<FitErrors> bricks(residual.index.size());
  parallelFor(std::size_t(0), bricks.size(),
              [&](std::size_t b) { bricks[b] = errorsOfBrick(target, residual, b); });
  FitErrors errors;
  for (const FitErrors& brick : bricks) errors.add(brick);
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
