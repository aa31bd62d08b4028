#include "fit/paper/densify.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "fit/paper/paper_math.h"
#include "fit/sampling_options.h"

namespace esvr::paper {
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

}  // namespace esvr::paper
