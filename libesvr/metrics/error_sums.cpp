#include "metrics/error_sums.h"

#include <bit>
#include <cmath>

#include "core/parallel.h"

namespace esvr::metrics {
namespace {

constexpr std::size_t kPairsPerTask = 64;

void keepLargest(ErrorSums& sums, double error, Coord at) {
  if (error <= sums.maxError) return;
  sums.maxError = error;
  sums.maxErrorAt = at;
}

void addVoxel(ErrorSums& sums, const PairValues& values, const Backgrounds& backgrounds,
              int offset) {
  const double error = values.error(offset);
  sums.squaredError += error * error;
  sums.massReference += values.reference(offset) - backgrounds.reference;
  sums.massCandidate += values.candidate(offset) - backgrounds.candidate;
  keepLargest(sums, std::abs(error), values.voxel(offset));
}

void addBox(ErrorSums& sums, const BrickPair& pair, const ErrorDomain& domain) {
  const Box local = localBox(pair.brick, domain.box);
  const PairValues values(pair);
  sums.voxels += local.volume();
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z)
        addVoxel(sums, values, domain.backgrounds, voxelOffset({x, y, z}));
}

void addActive(ErrorSums& sums, const BrickPair& pair) {
  if (!pair.referenceActive) return;
  const PairValues values(pair);
  for (int offset = 0; offset < kBrickVoxels; ++offset) {
    if (!values.referenceActive(offset)) continue;
    const double error = values.error(offset);
    sums.squaredErrorActive += error * error;
  }
}

void countTopology(ErrorSums& sums, const BrickPair& pair) {
  static constexpr BrickMask kNone{};
  const BrickMask& a = pair.referenceActive ? *pair.referenceActive : kNone;
  const BrickMask& b = pair.candidateActive ? *pair.candidateActive : kNone;
  sums.activeReference += std::uint64_t(a.count());
  for (int word = 0; word < kBrickSide; ++word) {
    sums.activeUnion += std::uint64_t(std::popcount(a.words[word] | b.words[word]));
    sums.activeIntersection += std::uint64_t(std::popcount(a.words[word] & b.words[word]));
  }
}

void findNonFinite(ErrorSums& sums, const BrickPair& pair) {
  const PairValues values(pair);
  for (int offset = 0; offset < kBrickVoxels && !sums.nonFinite; ++offset)
    if (!std::isfinite(values.error(offset))) sums.nonFinite = values.voxel(offset);
}

ErrorSums ofPair(const BrickPair& pair, const ErrorDomain& domain) {
  ErrorSums sums;
  addBox(sums, pair, domain);
  addActive(sums, pair);
  countTopology(sums, pair);
  findNonFinite(sums, pair);
  return sums;
}

/// Merges sums. `b` belongs to later bricks; of equal largest errors, the first voxel is kept.
ErrorSums joined(ErrorSums a, const ErrorSums& b) {
  a.voxels += b.voxels;
  a.squaredError += b.squaredError;
  a.massReference += b.massReference;
  a.massCandidate += b.massCandidate;
  keepLargest(a, b.maxError, b.maxErrorAt);
  a.squaredErrorActive += b.squaredErrorActive;
  a.activeReference += b.activeReference;
  a.activeUnion += b.activeUnion;
  a.activeIntersection += b.activeIntersection;
  if (!a.nonFinite) a.nonFinite = b.nonFinite;
  return a;
}

}  // namespace

ErrorSums sumErrors(std::span<const BrickPair> pairs, const ErrorDomain& domain) {
  using Range = tbb::blocked_range<std::size_t>;
  return parallelDeterministicReduce(
      Range(0, pairs.size(), kPairsPerTask), ErrorSums{},
      [&](const Range& range, ErrorSums sums) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          sums = joined(sums, ofPair(pairs[i], domain));
        return sums;
      },
      joined);
}

}  // namespace esvr::metrics
