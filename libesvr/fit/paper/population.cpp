#include "fit/paper/population.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/parallel.h"
#include "field/support.h"
#include "fit/seed.h"

namespace esvr::paper {

std::vector<PaperEllipsoid> initialPoints(const FitTarget& target, std::size_t points,
                                          const KernelKind& kind, std::uint64_t seed) {
  // Distances between evenly spread spheres that a sphere reaches. A Gaussian that ends at 3 sigma
  // reaches as far if its sigma is the distance, as in 3D Gaussian Splatting. An ellipsoid of the
  // same scale would reach 1.42 distances, and pruning then loses 9 dB of Aneurysm
  // (docs/figures/benchmarks.md, "The paper's method").
  constexpr double kReach = 3.0;
  const auto zeros = std::count(target.values.begin(), target.values.end(), 0.0f);
  const std::uint64_t voxels = std::uint64_t(target.values.size()) - std::uint64_t(zeros);
  const std::uint64_t count = std::min<std::uint64_t>(points, voxels);
  const double each = double(voxels) / double(std::max<std::uint64_t>(count, 1));
  const double units = kind.unitsPerScale(kind.k);
  const auto kernel = kernelConstants<double>(kernelOf(kind));
  const double scale = kReach * std::cbrt(each) * units / supportRadius(kernel);
  // the sum of a sphere over all voxels for an intensity of 1, shared among the voxels of a sphere
  const double overlap = kernelMoments(kernel).mass * std::pow(scale / units, 3.0) / each;

  std::vector<PaperEllipsoid> drawn;
  const auto nextAt = [&] {
    const auto n = double(drawn.size());
    return std::uint64_t((n + sampleUniform(seed, drawn.size())) * each);
  };
  std::uint64_t passed = 0, wanted = nextAt();
  for (std::size_t i = 0; i < target.values.size() && drawn.size() < count; ++i) {
    if (target.values[i] == 0.0f || passed++ != wanted) continue;
    const Coord v =
        target.bricks[i / kBrickVoxels] * kBrickSide + voxelLocal(int(i % kBrickVoxels));
    PaperEllipsoid p{
        {double(v.x), double(v.y), double(v.z)}, {}, {1.0, 0.0, 0.0, 0.0}, 0.0, kind.k};
    p.logScale.fill(std::log(scale));
    p.intensity = double(target.values[i]) / overlap;
    drawn.push_back(p);
    wanted = std::max(nextAt(), wanted + 1);
  }
  return drawn;
}

// --- Densification.

namespace {

constexpr double kShrink = 1.6;  // divisor of a split ellipsoid's scales: 0.8 times kParts
constexpr int kParts = 2;

/// Indices of the ellipsoids whose gradients reach the threshold, in increasing order.
std::vector<std::size_t> chosen(const Population& population, const DensifyRule& rule) {
  std::vector<std::pair<double, std::size_t>> candidates;
  for (std::size_t i = 0; i < population.size(); ++i)
    if (const double g = meanGradient(population.states[i]); g > 0.0 && g >= rule.threshold)
      candidates.emplace_back(-g, i);
  const std::size_t room = rule.maxCount - std::min(rule.maxCount, population.size());
  if (candidates.size() > room) {
    std::nth_element(candidates.begin(), candidates.begin() + std::ptrdiff_t(room),
                     candidates.end());
    candidates.resize(room);
  }
  std::vector<std::size_t> places;
  for (const auto& candidate : candidates) places.push_back(candidate.second);
  std::sort(places.begin(), places.end());
  return places;
}

double largestScale(const PaperEllipsoid& p) {
  return std::exp(*std::max_element(p.logScale.begin(), p.logScale.end()));
}

/// Normally distributed numbers of a random seed (Box and Muller 1958).
class Normals {
 public:
  explicit Normals(std::uint64_t seed) : seed_(seed) {}
  double operator()() {
    const double u = 1.0 - sampleUniform(seed_, next_), angle = sampleUniform(seed_, next_ + 1);
    next_ += 2;
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * angle);
  }

 private:
  std::uint64_t seed_, next_ = 0;
};

PaperEllipsoid partOf(const PaperEllipsoid& whole, Normals& normal) {
  PaperEllipsoid part = whole;
  const Matrix3 R = rotationOf(normalised(whole.rotation));
  for (int j = 0; j < 3; ++j) {
    const double along = std::exp(whole.logScale[j]) * normal();
    for (int i = 0; i < 3; ++i) part.center[i] += R[3 * i + j] * along;
    part.logScale[j] -= std::log(kShrink);
  }
  return part;
}

/// Removes the ellipsoids that were split; the others keep their order.
void removeSplit(Population& population, const std::vector<bool>& split) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < population.size(); ++i) {
    if (split[i]) continue;
    population.ellipsoids[kept] = population.ellipsoids[i];
    population.states[kept++] = population.states[i];
  }
  population.ellipsoids.resize(kept);
  population.states.resize(kept);
}

}  // namespace

double meanGradient(const PaperState& state) {
  return state.seen > 0 ? state.gradientSum / double(state.seen) : 0.0;
}

DensifyCounts densify(Population& population, const DensifyRule& rule) {
  std::vector<PaperEllipsoid> clones, parts;
  std::vector<bool> split(population.size(), false);
  Normals normal(rule.seed);
  for (const std::size_t i : chosen(population, rule)) {
    PaperEllipsoid& p = population.ellipsoids[i];
    split[i] = largestScale(p) > rule.splitAbove;
    if (split[i]) {
      for (int n = 0; n < kParts; ++n) parts.push_back(partOf(p, normal));
    } else {
      p.intensity *= 0.5;
      clones.push_back(p);
    }
  }
  removeSplit(population, split);
  for (const auto* added : {&clones, &parts})
    population.ellipsoids.insert(population.ellipsoids.end(), added->begin(), added->end());
  population.states.resize(population.size());
  for (PaperState& state : population.states) state.gradientSum = 0.0, state.seen = 0;
  return {clones.size(), parts.size() / kParts};
}

// --- Scores and pruning.

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

/// The factors gamma of LightGaussian: the volume of an ellipsoid divided by the 90th percentile of
/// all volumes, clamped to 1, to the power 0.1.
std::vector<double> volumeFactors(std::span<const PaperEllipsoid> ellipsoids) {
  constexpr double kPercentile = 0.9, kPower = 0.1;
  std::vector<double> volumes;
  for (const PaperEllipsoid& p : ellipsoids)
    volumes.push_back(std::exp(p.logScale[0] + p.logScale[1] + p.logScale[2]));
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

void dropUnseen(Population& population, const KernelKind& kind, const Box& box) {
  std::vector<double> seen(population.size());
  parallelFor(std::size_t(0), seen.size(), [&](std::size_t i) {
    seen[i] = coverageOf(population.ellipsoids[i], {kind, box, 0.0}).voxels > 0.0 ? 1.0 : 0.0;
  });
  std::size_t count = 0;
  for (const double s : seen) count += s > 0.0 ? 1 : 0;
  keepHighest(population, seen, count);
}

Field fieldOf(const Population& population, const KernelKind& kind, ExportFrame frame) {
  std::vector<Ellipsoid> ellipsoids;
  std::vector<double> kappas;
  for (const PaperEllipsoid& p : population.ellipsoids) {
    ellipsoids.push_back(ellipsoidOf(p, kind));
    if (kind.learnK) kappas.push_back(p.k);
  }
  frame.kernel = kernelOf(kind);
  frame.kappas = kappas;
  return exportField(ellipsoids, frame);
}

}  // namespace esvr::paper
