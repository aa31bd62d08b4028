// Plan: with one view, which looks along x, the score of an ellipsoid agrees with rays that are
// sampled densely. An opaque ellipsoid takes the light of those behind it, whatever the order of the
// list. Many views see an ellipsoid alike in any orientation. The number of threads does not matter.

#include "fit/paper/ray_scores.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "fit/paper/paper_math.h"

namespace esvr::paper {
namespace {

constexpr double kRayFloor = 1.0 / 255;
const CoverageOptions kRayOptions{{}, {{0, 0, 0}, {22, 22, 22}}, kRayFloor};
constexpr int kRayMiddle = 11,
              kRayReach = 20;  // the corners of the box are 19.1 voxels from its middle

PaperEllipsoid seenEllipsoid(std::array<double, 3> center, std::array<double, 3> scale,
                             double intensity) {
  return {center,
          {std::log(scale[0]), std::log(scale[1]), std::log(scale[2])},
          {0.8, 0.1, -0.5, 0.3},
          intensity,
          5.0};
}

/// The largest |I| phi on the ray along x through a voxel of the plane x = 0.
double largestAlong(const PaperEllipsoid& p, const KernelKind& kind, double y, double z) {
  constexpr double kStep = 0.01;
  const Ellipsoid unit = ellipsoidOf(p, kind);
  const auto kernel = kernelConstants<double>(kernelOf(kind));
  double largest = 0.0;
  for (double x = p.center[0] - kRayReach; x < p.center[0] + kRayReach; x += kStep) {
    const double d[3] = {x - p.center[0], y - p.center[1], z - p.center[2]};
    double m = 0.0;
    for (int r = 0; r < 3; ++r)
      m += std::pow(unit.L[3 * r] * d[0] + unit.L[3 * r + 1] * d[1] + unit.L[3 * r + 2] * d[2], 2);
    largest = std::max(largest, kernelPhi(kernel, m));
  }
  return std::abs(p.intensity) * largest;
}

double sampledScore(const PaperEllipsoid& p, const KernelKind& kind) {
  double sum = 0.0;
  for (int y = kRayMiddle - kRayReach; y <= kRayMiddle + kRayReach; ++y)
    for (int z = kRayMiddle - kRayReach; z <= kRayMiddle + kRayReach; ++z) {
      const double opacity = std::min(largestAlong(p, kind, y, z), 0.99);
      if (opacity >= kRayFloor) sum += opacity;
    }
  return sum;
}

TEST(RayScores, AgreeWithDenselySampledRays) {
  for (const KernelKind kind : {KernelKind{}, KernelKind{.gaussian = true}})
    for (const auto& p : {seenEllipsoid({10.2, 11.7, 9.4}, {3, 2, 1}, 0.5),
                          seenEllipsoid({11, 11, 11}, {5, 0.7, 1}, -2.0)}) {
      CoverageOptions options = kRayOptions;
      options.kind = kind;
      const auto scores = rayContributions(std::vector{p}, options, 1);
      // Steps of 0.01 voxels miss the maximum by at most |d2 phi| (0.005)^2 / 2, about 1e-4.
      EXPECT_NEAR(scores[0], sampledScore(p, kind), 1e-3 * scores[0]);
    }
}

TEST(RayScores, AreThoseOfTheLightThatIsLeft) {
  const auto behind = seenEllipsoid({16, 11, 11}, {1, 1, 1}, 0.5);
  const auto opaque = seenEllipsoid({5, 11, 11}, {4, 4, 4}, 1e4);
  const auto beside = seenEllipsoid({5, 2, 2}, {0.5, 0.5, 0.5}, 0.5);
  const double alone = rayContributions(std::vector{behind}, kRayOptions, 1)[0];
  const auto scores = rayContributions(std::vector{behind, opaque, beside}, kRayOptions, 1);
  EXPECT_NEAR(scores[0], 0.01 * alone, 1e-6 * alone) << "the opacity is at most 0.99";
  EXPECT_NEAR(rayContributions(std::vector{behind, beside}, kRayOptions, 1)[0], alone,
              1e-6 * alone);
}

TEST(RayScores, DoNotDependOnTheOrientation) {
  auto needle = seenEllipsoid({11, 11, 11}, {8, 3, 3}, 0.5);
  const double first = rayContributions(std::vector{needle}, kRayOptions)[0];
  for (const std::array<double, 4> turn : {std::array{1.0, 0.0, 0.0, 0.0}, {0.5, 0.5, 0.5, 0.5}}) {
    needle.rotation = turn;
    // 360 directions are 11 degrees apart, and the rays are samples of the edge.
    EXPECT_NEAR(rayContributions(std::vector{needle}, kRayOptions)[0], first, 0.02 * first);
  }
}

TEST(RayScores, DoNotDependOnTheNumberOfThreads) {
  std::vector<PaperEllipsoid> several;
  for (int i = 0; i < 40; ++i)
    several.push_back(seenEllipsoid({double(i % 23), double(7 * i % 23), double(13 * i % 23)},
                                    {1.0 + i % 3, 1.0, 2.0}, 0.3));
  const auto scores = rayContributions(several, kRayOptions);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(rayContributions(several, kRayOptions), scores);
}

TEST(RayScores, AreZeroBesideThePictures) {
  const auto far = seenEllipsoid({1e6, -1e6, 11}, {1, 1, 1}, 0.5);
  EXPECT_EQ(rayContributions(std::vector{far}, kRayOptions)[0], 0.0);
  EXPECT_TRUE(rayContributions({}, kRayOptions).empty());
}

}  // namespace
}  // namespace esvr::paper
