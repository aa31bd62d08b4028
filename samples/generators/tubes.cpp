#include "generators/tubes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "generators/soft_edge.h"

namespace esvr::samples {
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
  return voxelise(TubeShape(tubes, edge), {.box = boundsOf(tubes, edge),
                                           .background = 0.0f,
                                           .maxBricks = limits.maxBricks,
                                           .cancel = limits.cancel});
}

}  // namespace esvr::samples
