#include "generators/level_set.h"

#include <algorithm>
#include <cmath>

namespace esvr::samples {
namespace {

// Lengths are in units of the resolution, relative to the middle.
constexpr double kRingRadius = 0.33, kRingThickness = 0.1;
constexpr Vec3 kBallCenters[] = {{0.33, 0.0, 0.0}, {-0.2, 0.1, 0.2}};
constexpr double kBallRadius = 0.15;

double distanceToRing(Vec3 p) {
  const double fromCircle = std::sqrt(p.x * p.x + p.z * p.z) - kRingRadius;
  return std::sqrt(fromCircle * fromCircle + p.y * p.y) - kRingThickness;
}

}  // namespace

double LevelSetShape::distance(Vec3 p) const {
  const Vec3 q = (p + Vec3{0.5, 0.5, 0.5}) * (1.0 / resolution_) - Vec3{0.5, 0.5, 0.5};
  double nearest = distanceToRing(q);
  for (const Vec3 center : kBallCenters)
    nearest = std::min(nearest, length(q - center) - kBallRadius);
  return nearest * resolution_;
}

std::optional<LevelSetShape> LevelSetShape::within(const Ball& ball) const {
  if (std::abs(distance(ball.center)) >= ball.radius + kBandVoxels) return std::nullopt;
  return *this;
}

Sample LevelSetShape::at(Vec3 p) const {
  const double d = distance(p);
  const double clamped = std::clamp(d, -kBandVoxels, kBandVoxels);
  return {float(clamped * voxelSize_), std::abs(d) < kBandVoxels};
}

SparseVolume makeLevelSet(const SampleOptions& options, double voxelSize) {
  const auto band = int(kBandVoxels) + 1;
  const int last = options.resolution + band;
  return voxelise(LevelSetShape(options.resolution, voxelSize),
                  {.box = {{-band, -band, -band}, {last, last, last}},
                   .background = float(kBandVoxels * voxelSize),
                   .maxBricks = options.limits.maxBricks,
                   .cancel = options.limits.cancel});
}

}  // namespace esvr::samples
