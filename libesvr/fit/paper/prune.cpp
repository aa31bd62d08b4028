#include "fit/paper/prune.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"
#include "field/support.h"
#include "fit/paper/paper_math.h"
#include "fit/paper/ray_scores.h"

namespace esvr::paper {
namespace {

/// The voxels of a box that a support can reach.
Box reachOf(const Support& s, const Box& box) {
  Box reach;
  const auto low = [&](int a) { return std::int32_t(std::ceil(s.center[a] - s.half[a])); };
  const auto high = [&](int a) { return std::int32_t(std::floor(s.center[a] + s.half[a])); };
  reach.min = maxCoord({low(0), low(1), low(2)}, box.min);
  reach.max = minCoord({high(0), high(1), high(2)}, box.max);
  return reach;
}

double squaredAt(const Ellipsoid& p, Coord v) {
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    const double u = p.L[3 * r] * d[0] + p.L[3 * r + 1] * d[1] + p.L[3 * r + 2] * d[2];
    m += u * u;
  }
  return m;
}

double volumeOf(const PaperEllipsoid& p) {
  return std::exp(p.logScale[0] + p.logScale[1] + p.logScale[2]);
}

/// The factors gamma of LightGaussian: the volume of an ellipsoid divided by the 90th percentile of
/// all volumes, clamped to 1, to the power 0.1.
std::vector<double> volumeFactors(std::span<const PaperEllipsoid> ellipsoids) {
  constexpr double kPercentile = 0.9, kPower = 0.1;
  std::vector<double> volumes(ellipsoids.size());
  std::transform(ellipsoids.begin(), ellipsoids.end(), volumes.begin(), volumeOf);
  if (volumes.empty()) return volumes;
  std::vector<double> sorted = volumes;
  const auto at = sorted.begin() + std::ptrdiff_t(kPercentile * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), at, sorted.end());
  for (double& v : volumes) v = std::pow(std::min(v / *at, 1.0), kPower);
  return volumes;
}

double scoreOf(const PaperEllipsoid& p, PruneScore score, const CoverageOptions& options) {
  const double fa = fractionalAnisotropy(p.logScale);
  if (score == PruneScore::kOnlyFa) return fa;
  const Coverage coverage = coverageOf(p, options);
  if (score == PruneScore::kContribution) return coverage.contribution;
  const double withoutFa = coverage.voxels * std::abs(p.intensity);
  return score == PruneScore::kWithoutFa ? withoutFa : withoutFa * fa;
}

}  // namespace

double fractionalAnisotropy(const std::array<double, 3>& logScale) {
  // Scales are taken relative to the largest one, so that fourth powers do not overflow.
  const double largest = *std::max_element(logScale.begin(), logScale.end());
  const auto lambda = [&](int a) { return std::exp(2.0 * (logScale[a] - largest)); };
  const double a = lambda(0), b = lambda(1), c = lambda(2);
  const double between = (a - b) * (a - b) + (b - c) * (b - c) + (c - a) * (c - a);
  return std::sqrt(0.5 * between / (a * a + b * b + c * c));
}

Coverage coverageOf(const PaperEllipsoid& ellipsoid, const CoverageOptions& options) {
  const Ellipsoid p = ellipsoidOf(ellipsoid, options.kind);
  const auto kernel = constantsOf(ellipsoid, options.kind);
  const double height = std::abs(p.intensity);
  const Box reach = reachOf(makeSupport(p.center, p.L, supportRadius(kernel), 0.0), options.box);
  Coverage coverage;
  Coord v;
  for (v.x = reach.min.x; v.x <= reach.max.x; ++v.x)
    for (v.y = reach.min.y; v.y <= reach.max.y; ++v.y)
      for (v.z = reach.min.z; v.z <= reach.max.z; ++v.z)
        if (const double value = height * kernelPhi(kernel, squaredAt(p, v));
            value >= options.floor && value > 0.0) {
          coverage.voxels += 1.0;
          coverage.contribution += value;
        }
  return coverage;
}

std::vector<double> pruneScores(std::span<const PaperEllipsoid> ellipsoids, PruneScore score,
                                const CoverageOptions& options) {
  std::vector<double> scores(ellipsoids.size());
  if (score == PruneScore::kRays)
    scores = rayContributions(ellipsoids, options);
  else
    parallelFor(std::size_t(0), scores.size(),
                [&](std::size_t i) { scores[i] = scoreOf(ellipsoids[i], score, options); });
  if (score != PruneScore::kContribution && score != PruneScore::kRays) return scores;
  const auto factors = volumeFactors(ellipsoids);
  for (std::size_t i = 0; i < scores.size(); ++i) scores[i] *= factors[i];
  return scores;
}

void keepHighest(Population& population, std::span<const double> scores, std::size_t keep) {
  if (keep >= population.size()) return;
  std::vector<std::size_t> order(population.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scores[a] > scores[b]; });
  order.resize(keep);
  std::sort(order.begin(), order.end());
  for (std::size_t n = 0; n < keep; ++n) {
    population.ellipsoids[n] = population.ellipsoids[order[n]];
    population.states[n] = population.states[order[n]];
  }
  population.ellipsoids.resize(keep);
  population.states.resize(keep);
}

}  // namespace esvr::paper
