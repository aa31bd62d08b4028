#include "generators/tubes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "esvr/error.h"
#include "generators/hash_noise.h"

namespace esvr::samples {

// The shape of tubes.

namespace {

double distanceToBall(Vec3 center, double radius, Vec3 p) { return length(p - center) - radius; }

Vec3 outerCorner(const Tube& tube, double reach, double sign) {
  const auto corner = [&](Vec3 center, double radius) {
    const double r = sign * (radius + reach);
    return center + Vec3{r, r, r};
  };
  const Vec3 a = corner(tube.a, tube.radiusA), b = corner(tube.b, tube.radiusB);
  return sign < 0.0 ? minVec(a, b) : maxVec(a, b);
}

Coord floorCoord(Vec3 v) {
  return {std::int32_t(std::floor(v.x)), std::int32_t(std::floor(v.y)),
          std::int32_t(std::floor(v.z))};
}

}  // namespace

double signedDistance(const Tube& tube, Vec3 p) {
  const Vec3 axis = tube.b - tube.a;
  const double span = length(axis);
  // the radius shrinks by `slope` for each unit of length; if it changes faster than the centre
  // moves, the larger ball contains the smaller one
  const double shrink = tube.radiusA - tube.radiusB;
  if (std::abs(shrink) >= span)
    return shrink > 0.0 ? distanceToBall(tube.a, tube.radiusA, p)
                        : distanceToBall(tube.b, tube.radiusB, p);
  const double slope = shrink / span;
  const Vec3 direction = axis * (1.0 / span), relative = p - tube.a;
  const double along = dot(relative, direction);
  const double across = length(relative - direction * along);
  // the ball with the nearest surface: the minimum over t of |p - c(t)| - r(t)
  const double nearest = along - slope * across / std::sqrt(1.0 - slope * slope);
  const double t = std::clamp(nearest, 0.0, span);
  return distanceToBall(tube.a + direction * t, tube.radiusA - slope * t, p);
}

TubeShape::TubeShape(std::span<const Tube> tubes, double edge)
    : tubes_(tubes), edge_(edge), near_(tubes.size()) {
  std::iota(near_.begin(), near_.end(), 0u);
}

std::optional<TubeShape> TubeShape::within(const Ball& ball) const {
  std::vector<double> distances(near_.size());
  std::transform(near_.begin(), near_.end(), distances.begin(),
                 [&](std::uint32_t i) { return signedDistance(tubes_[i], ball.center); });
  const double nearest = *std::min_element(distances.begin(), distances.end());
  // The slope of distances is at most 1. A tube further away than this is nowhere the nearest in
  // the ball, or its edge does not reach the ball.
  const double furthest = std::min(nearest + 2.0 * ball.radius, ball.radius + edge_ / 2.0);
  std::vector<std::uint32_t> near;
  for (std::size_t k = 0; k < near_.size(); ++k)
    if (distances[k] <= furthest) near.push_back(near_[k]);
  if (near.empty()) return std::nullopt;
  near.shrink_to_fit();
  return TubeShape(tubes_, edge_, std::move(near));
}

Sample TubeShape::at(Vec3 p) const {
  double distance = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : near_) distance = std::min(distance, signedDistance(tubes_[i], p));
  const float value = softEdge(distance, edge_);
  return {value, value > 0.0f};
}

Box boundsOf(std::span<const Tube> tubes, double edge) {
  Vec3 low = tubes.front().a, high = low;
  for (const Tube& tube : tubes) {
    low = minVec(low, outerCorner(tube, edge / 2.0, -1.0));
    high = maxVec(high, outerCorner(tube, edge / 2.0, 1.0));
  }
  return {floorCoord(low), floorCoord(high) + Coord{1, 1, 1}};
}

SparseVolume voxeliseTubes(std::span<const Tube> tubes, double edge, const Limits& limits) {
  return voxelise(TubeShape(tubes, edge),
                  {.box = boundsOf(tubes, edge), .background = 0.0f, .limits = limits});
}

// Scales.

namespace {

struct Extent {
  Vec3 low, high;
};

Vec3 cube(double half) { return {half, half, half}; }

Extent extentOf(std::span<const Tube> tubes) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Extent extent{cube(kInfinity), cube(-kInfinity)};
  const auto include = [&](Vec3 center, double radius) {
    extent.low = minVec(extent.low, center - cube(radius));
    extent.high = maxVec(extent.high, center + cube(radius));
  };
  for (const Tube& tube : tubes) {
    include(tube.a, tube.radiusA);
    include(tube.b, tube.radiusB);
  }
  return extent;
}

}  // namespace

ScaledTubes fitTubes(std::span<const Tube> tubes, const TubeScale& scale) {
  const Extent extent = extentOf(tubes);
  const Vec3 size = extent.high - extent.low;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0.0) || !std::isfinite(longest)) throw BadInput("the tubes have no extent");

  ScaledTubes scaled;
  scaled.voxelSize = longest / scale.resolution;
  scaled.origin = extent.low + cube((0.5 - scale.margin) * scaled.voxelSize);
  const auto place = [&](Vec3 p) { return (p - scaled.origin) * (1.0 / scaled.voxelSize); };
  const auto radius = [&](double r) { return std::max(r / scaled.voxelSize, scale.minRadius); };
  for (const Tube& tube : tubes)
    scaled.tubes.push_back(
        {place(tube.a), place(tube.b), radius(tube.radiusA), radius(tube.radiusB)});
  return scaled;
}

// Branching vessels.

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
