#include "render/scene_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/cell_corner.h"
#include "esvr/error.h"
#include "render/ellipsoid_view.h"

namespace esvr {
namespace {

struct Distances {
  double nearest, farthest;
};

/// Expands the box by the sphere around a support. That is exact enough, because the box only
/// decides where rays begin and end.
void expand(PlaceBox& box, const PackedEllipsoid& e, const Vec3& origin, double radius) {
  const double reach = radius * std::max({e.scale[0], e.scale[1], e.scale[2]});
  for (int a = 0; a < 3; ++a) {
    box.low[a] = std::min(box.low[a], origin[a] + e.center[a] - reach);
    box.high[a] = std::max(box.high[a], origin[a] + e.center[a] + reach);
  }
}

Vec3 corner(const PlaceBox& box, int number) {
  const Coord step = stepToCorner(number);
  return {(step.x ? box.high : box.low)[0], (step.y ? box.high : box.low)[1],
          (step.z ? box.high : box.low)[2]};
}

double distanceTo(const PlaceBox& box, const Vec3& eye) {
  Vec3 away{};
  for (int a = 0; a < 3; ++a) away[a] = std::max({box.low[a] - eye[a], 0.0, eye[a] - box.high[a]});
  return length(away);
}

/// The distances for voxels that are no cubes. The nearest one is that of the sphere around the box.
Distances fromEyeByCoordinates(const PlaceBox& box, const View& view) {
  const Vec3 middle = scaled(sum(box.low, box.high), 0.5);
  double radius = 0.0;
  Distances d{0.0, 0.0};
  for (int c = 0; c < kCellCorners; ++c) {
    const Vec3 at = corner(box, c);
    radius = std::max(radius, length(view.coordinates(difference(at, middle))));
    d.farthest = std::max(d.farthest, length(view.coordinates(difference(at, view.eye))));
  }
  d.nearest = std::max(0.0, length(view.coordinates(difference(middle, view.eye))) - radius);
  return d;
}

Distances fromEye(const PlaceBox& box, const View& view) {
  if (!view.isCube) return fromEyeByCoordinates(box, view);
  Distances d{distanceTo(box, view.eye), 0.0};
  for (int c = 0; c < kCellCorners; ++c)
    d.farthest = std::max(d.farthest, length(difference(corner(box, c), view.eye)));
  return d;
}

Distances alongForward(const PlaceBox& box, const View& view) {
  Distances d{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (int c = 0; c < kCellCorners; ++c) {
    const double depth = inner(view.ofForward, difference(corner(box, c), view.eye));
    d.nearest = std::min(d.nearest, depth), d.farthest = std::max(d.farthest, depth);
  }
  return d;
}

}  // namespace

std::optional<PlaceBox> supportBox(const Field& field) {
  const auto ellipsoids = packed(field);
  if (ellipsoids.empty()) return std::nullopt;
  const auto origins = chunkOrigins(field);
  const auto kernels = rayKernels(field);
  constexpr double kAll = std::numeric_limits<double>::infinity();
  PlaceBox box{{kAll, kAll, kAll}, {-kAll, -kAll, -kAll}};
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const double cutoff = kernels[kernels.size() == 1 ? 0 : i].cutoff;
    expand(box, ellipsoids[i], origins[ellipsoids[i].chunk], std::sqrt(cutoff));
  }
  return box;
}

BinRange binsWithin(const PlaceBox& box, const View& view, double step) {
  const Distances d = view.perspective ? fromEye(box, view) : alongForward(box, view);
  if (d.farthest < 0.0) return {0, -1};
  ScreenBounds bounds{};
  bounds.nearest = std::max(0.0, d.nearest), bounds.farthest = d.farthest;
  return binsOf(bounds, {1.0, 1.0}, step);
}

void checkRayLength(const BinRange& bins) {
  constexpr std::int64_t kMaxBins = kMostRaySamples / kBinSamples;
  const std::int64_t count = bins.last - bins.first + 1;
  if (count > kMaxBins)
    throw UsageError("rays of " + std::to_string(count) + " x " + std::to_string(kBinSamples) +
                     " samples are too long; take a longer step");
}

}  // namespace esvr
