#include "generators/fit_tubes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"

namespace esvr::samples {
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

}  // namespace esvr::samples
