#include "generators/tree.h"

#include <array>

#include "generators/fit_tubes.h"
#include "generators/hash_noise.h"

namespace esvr::samples {
namespace {

constexpr double kTrunkRadius = 1.0;
constexpr double kTwigRadius = 0.09;  // radius below which branches do not fork
constexpr int kTubesPerBranch = 6;
constexpr double kTubeLength = 2.9;  // length of a tube in radii of the branch
constexpr double kMeander = 0.32;    // random share of each step's direction
constexpr double kTaper = 0.98;      // factor of the radius for each step
constexpr double kSpread = 0.45;     // sideways share of a fork's directions

/// Radii of a fork's two branches relative to their parent's. By Murray's law the sum of their
/// cubes is 1.
constexpr std::array<std::array<double, 2>, 3> kForks{
    {{0.794, 0.794}, {0.870, 0.699}, {0.930, 0.580}}};

struct Branch {
  Vec3 start, direction;
  double radius;
};

/// Adds the tubes of a branch. \return the end of the branch
Branch grow(Branch at, Random& random, std::vector<Tube>& tubes) {
  for (int i = 0; i < kTubesPerBranch; ++i) {
    at.direction = normalised(at.direction + random.direction() * kMeander);
    const Vec3 end = at.start + at.direction * (at.radius * kTubeLength * random.uniform(0.7, 1.3));
    tubes.push_back({at.start, end, at.radius, at.radius * kTaper});
    at.start = end;
    at.radius *= kTaper;
  }
  return at;
}

Vec3 sidewaysFrom(Vec3 direction, Random& random) {
  const Vec3 any = random.direction();
  return normalised(any - direction * dot(any, direction) + Vec3{1e-9, 0.0, 0.0});
}

std::array<Branch, 2> fork(const Branch& end, Random& random) {
  const auto& radii = kForks[std::size_t(random.uniform() * kForks.size())];
  const Vec3 sideways = sidewaysFrom(end.direction, random);
  const auto branch = [&](double ratio, double side) {
    // the thinner branch turns away more
    const Vec3 turned = end.direction + sideways * (side * kSpread / ratio);
    return Branch{end.start, normalised(turned), end.radius * ratio};
  };
  return {branch(radii[0], 1.0), branch(radii[1], -1.0)};
}

std::vector<Tube> growTree(std::uint64_t seed) {
  Random random(seed);
  std::vector<Tube> tubes;
  std::vector<Branch> open{{{}, {0.0, 1.0, 0.0}, kTrunkRadius}};
  while (!open.empty()) {
    const Branch end = grow(open.back(), random, tubes);
    open.pop_back();
    if (end.radius < kTwigRadius) continue;
    for (const Branch& branch : fork(end, random)) open.push_back(branch);
  }
  return tubes;
}

}  // namespace

std::vector<Tube> treeTubes(const SampleOptions& options) {
  const auto tubes = growTree(options.seed);
  return fitTubes(tubes, {.resolution = options.resolution, .minRadius = kThinnestTube}).tubes;
}

SparseVolume makeTree(const SampleOptions& options) {
  return voxeliseTubes(treeTubes(options), kDefaultEdge, options.limits);
}

}  // namespace esvr::samples
