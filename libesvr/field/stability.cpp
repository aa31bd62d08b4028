#include "esvr/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "esvr/field.h"
#include "field/extreme_ellipsoids.h"
#include "field/reference_brick.h"

namespace esvr {
namespace {

/// Sums over voxels from which the figures of a field follow.
struct BrickFigures {
  BrickDifference difference;
  double magnitudes = 0.0, sums = 0.0;  ///< of the terms, and of the magnitudes of their sums
  double peak = 0.0;
  double hits = 0.0, voxelsHit = 0.0;
  std::uint32_t largestOverlap = 0;
};

/// A field, and the comparison of its evaluations.
class FieldComparison {
 public:
  FieldComparison(const Field& field, const StabilityOptions& options)
      : field_(field), options_(options), reference_(field) {}

  [[nodiscard]] BrickFigures compare(Coord corner, const ReferenceBrick& brick,
                                     const float* values) const {
    BrickFigures figures;
    figures.difference.corner = figures.difference.at = corner;
    for (int v = 0; v < kBrickVoxels; ++v) {
      addTerms(figures, brick.voxels[std::size_t(v)]);
      addDifference(figures.difference, brick, v, values[v]);
    }
    return figures;
  }
  [[nodiscard]] ReferenceBrick reference(Coord corner) const { return reference_.evaluate(corner); }

 private:
  static void addTerms(BrickFigures& figures, const VoxelTerms& terms) {
    figures.magnitudes += terms.magnitudes;
    figures.sums += std::abs(terms.sum);
    figures.peak = std::max(figures.peak, std::abs(terms.sum));
    figures.hits += terms.count;
    figures.voxelsHit += terms.count > 0 ? 1.0 : 0.0;
    figures.largestOverlap = std::max(figures.largestOverlap, terms.count);
  }

  [[nodiscard]] double clamped(double value) const {
    if (!options_.range) return value;
    return std::clamp(value, double(options_.range->min), double(options_.range->max));
  }

  void addDifference(BrickDifference& all, const ReferenceBrick& brick, int v, float value) const {
    const double expected = double(field_.background) + brick.voxels[std::size_t(v)].sum;
    const double difference = std::isfinite(value) ? std::abs(clamped(value) - clamped(expected))
                                                   : std::numeric_limits<double>::infinity();
    const double bound = reference_.bound(brick, v, options_.arithmetic);
    all.squares += difference * difference;
    all.bound = std::max(all.bound, bound);
    if (difference > 0.0) all.shareOfBound = std::max(all.shareOfBound, difference / bound);
    if (difference <= all.largest) return;
    all.largest = difference;
    all.at = all.corner + voxelLocal(v);
  }

  const Field& field_;
  const StabilityOptions& options_;
  ReferenceField reference_;
};

/// `count` elements of a list, spread evenly over it.
std::vector<Coord> spreadOver(std::span<const Coord> bricks, std::size_t count) {
  count = std::min(count, bricks.size());
  std::vector<Coord> chosen;
  for (std::size_t n = 0; n < count; ++n)
    chosen.push_back(bricks[(2 * n + 1) * bricks.size() / (2 * count)]);
  return chosen;
}

/// The bricks that are compared, increasing.
std::vector<Coord> samplesOf(const Field& field, std::span<const Coord> bricks, std::size_t count) {
  std::vector<Coord> samples = spreadOver(bricks, count);
  for (const Coord voxel : centersOfExtremes(field)) {
    const Coord corner = brickOf(voxel) * kBrickSide;
    if (std::ranges::binary_search(bricks, corner)) samples.push_back(corner);
  }
  std::ranges::sort(samples);
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

/// The largest cancellation of a voxel whose sum is not small.
double largestCancellation(const ReferenceBrick& brick, double peak) {
  constexpr double kSmallSum = 0.01;
  double largest = 1.0;
  for (const VoxelTerms& terms : brick.voxels)
    if (terms.sum != 0.0 && std::abs(terms.sum) >= kSmallSum * peak)
      largest = std::max(largest, terms.magnitudes / std::abs(terms.sum));
  return largest;
}

void summarise(const std::vector<BrickFigures>& figures, Stability& result) {
  double squares = 0.0, magnitudes = 0.0, sums = 0.0, hits = 0.0, voxelsHit = 0.0;
  for (const BrickFigures& f : figures) {
    result.largest = std::max(result.largest, f.difference.largest);
    result.bound = std::max(result.bound, f.difference.bound);
    result.shareOfBound = std::max(result.shareOfBound, f.difference.shareOfBound);
    result.peak = std::max(result.peak, f.peak);
    result.largestOverlap = std::max(result.largestOverlap, f.largestOverlap);
    squares += f.difference.squares;
    magnitudes += f.magnitudes, sums += f.sums;
    hits += f.hits, voxelsHit += f.voxelsHit;
  }
  result.sampled = figures.size();
  if (!figures.empty()) result.rms = std::sqrt(squares / double(figures.size() * kBrickVoxels));
  if (sums > 0.0) result.meanCancellation = magnitudes / sums;
  if (voxelsHit > 0.0) result.meanOverlap = hits / voxelsHit;
}

/// The bricks of the largest differences.
std::vector<BrickDifference> worstOf(const std::vector<BrickFigures>& figures, std::size_t count) {
  std::vector<BrickDifference> all;
  for (const BrickFigures& f : figures) all.push_back(f.difference);
  std::ranges::stable_sort(all, std::ranges::greater{}, &BrickDifference::largest);
  all.resize(std::min(all.size(), count));
  return all;
}

}  // namespace

Stability measureStability(const Field& field, const StabilityOptions& options) {
  std::vector<Coord> reached;
  std::span<const Coord> bricks = options.bricks;
  if (bricks.empty()) bricks = reached = reachedBricks(field, options.within);
  const std::vector<Coord> samples = samplesOf(field, bricks, options.samples);

  std::vector<float> values(samples.size() * kBrickVoxels);
  (options.evaluate ? options.evaluate : EvaluateBricks(evaluateBricks))(field, samples, values);

  Stability result;
  result.extremes = extremesOf(field);
  result.bricks = bricks.size();
  const FieldComparison comparison(field, options);
  std::vector<ReferenceBrick> references(samples.size());
  std::vector<BrickFigures> figures(samples.size());
  parallelFor(std::size_t{0}, samples.size(), [&](std::size_t b) {
    references[b] = comparison.reference(samples[b]);
    figures[b] = comparison.compare(samples[b], references[b], &values[b * kBrickVoxels]);
  });
  summarise(figures, result);
  for (const ReferenceBrick& brick : references)
    result.largestCancellation =
        std::max(result.largestCancellation, largestCancellation(brick, result.peak));
  result.worst = worstOf(figures, options.worst);
  return result;
}

int correctDigits(double difference, double peak) {
  constexpr int kMost = std::numeric_limits<double>::max_digits10;
  if (difference == 0.0) return kMost;
  const double share = difference / peak;
  if (!(share < 1.0)) return 0;
  return std::min(kMost, int(std::floor(-std::log10(share))));
}

}  // namespace esvr
