// Plan: the distance to a round cone agrees with a search over its balls. The tests also check soft
// edges and the scale of a set of tubes.

#include "generators/tubes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "generators/hash_noise.h"

namespace esvr::samples {
namespace {

/// The minimum over the balls of a tube, on a fine grid along its axis.
double searchedDistance(const Tube& tube, Vec3 p) {
  constexpr int kBalls = 20'000;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kBalls; ++i) {
    const double t = double(i) / kBalls;
    const double radius = tube.radiusA + (tube.radiusB - tube.radiusA) * t;
    nearest = std::min(nearest, length(p - (tube.a + (tube.b - tube.a) * t)) - radius);
  }
  return nearest;
}

TEST(SignedDistance, isTheMinimumOverTheBalls) {
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    const Tube tube{random.inCube(-2.0, 2.0), random.inCube(-2.0, 2.0), random.uniform(0.0, 2.0),
                    random.uniform(0.0, 2.0)};
    const Vec3 p = random.inCube(-4.0, 4.0);
    // The error of the search is of second order in its step: (7 / 20000)^2 over distances >= 1e-3.
    EXPECT_NEAR(signedDistance(tube, p), searchedDistance(tube, p), 2e-4) << "tube " << i;
  }
}

TEST(SignedDistance, ofATubeWithoutLengthIsThatOfTheLargerBall) {
  const Tube tube{{1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 0.5, 0.25};
  EXPECT_DOUBLE_EQ(signedDistance(tube, {3.0, 0.0, 0.0}), 1.5);
  EXPECT_DOUBLE_EQ(signedDistance({tube.b, tube.a, 0.25, 0.5}, {3.0, 0.0, 0.0}), 1.5);
}

TEST(VoxeliseTubes, fadesOverTheEdgeAcrossTheSurface) {
  const Tube tube{{20.0, 20.0, 0.0}, {20.0, 20.0, 40.0}, 5.0, 5.0};
  const SparseVolume volume = voxeliseTubes(std::vector{tube}, 2.0, {});
  EXPECT_EQ(valueAt(volume, {20, 20, 20}), 1.0f);
  EXPECT_EQ(valueAt(volume, {24, 20, 20}), 1.0f);  // distance -1, which is half the edge
  EXPECT_EQ(valueAt(volume, {25, 20, 20}), 0.5f);
  EXPECT_EQ(valueAt(volume, {26, 20, 20}), 0.0f);
  EXPECT_EQ(activeBox(volume), (Box{{15, 15, -5}, {25, 25, 45}}));
}

TEST(FitTubes, givesTheLongestSideTheResolution) {
  const std::vector<Tube> tubes{{{100.0, 5.0, 5.0}, {150.0, 5.0, 5.0}, 5.0, 5.0}};
  const auto scaled = fitTubes(tubes, {.resolution = 120, .minRadius = 0.75, .margin = 1});
  EXPECT_DOUBLE_EQ(scaled.voxelSize, 0.5);
  const Tube& tube = scaled.tubes.front();
  EXPECT_DOUBLE_EQ(tube.radiusA, 10.0);
  // The surface begins at the lower face of voxel 1, which is at 0.5.
  EXPECT_DOUBLE_EQ(tube.a.x - tube.radiusA, 0.5);
  EXPECT_DOUBLE_EQ(scaled.origin.x + tube.a.x * scaled.voxelSize, 100.0);
}

TEST(FitTubes, thickensWhatIsThinnerThanTheMinimum) {
  const std::vector<Tube> tubes{{{0.0, 0.0, 0.0}, {100.0, 0.0, 0.0}, 0.0, 0.01}};
  const auto scaled = fitTubes(tubes, {.resolution = 50, .minRadius = 0.75});
  EXPECT_EQ(scaled.tubes.front().radiusA, 0.75);
  EXPECT_EQ(scaled.tubes.front().radiusB, 0.75);
}

TEST(FitTubes, refusesTubesWithoutExtent) {
  const std::vector<Tube> tubes{{{1.0, 2.0, 3.0}, {1.0, 2.0, 3.0}, 0.0, 0.0}};
  EXPECT_THROW((void)fitTubes(tubes, {}), BadInput);
}

}  // namespace
}  // namespace esvr::samples
