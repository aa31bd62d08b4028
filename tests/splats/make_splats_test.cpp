// Plan: splats are made of fields whose optical depth has a closed form. A splat's depth, summed over a picture and
// averaged over directions, must be that of its ellipsoid; transmittances of composited splats are compared with
// integrals of the density. Colors, places and refusals are checked on single ellipsoids.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/geometry.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/splats.h"
#include "splats/gaussian.h"

namespace esvr {
namespace {

using testing::HasSubstr;

/// A grid of ellipsoids that follow from their sum alone.
StoredGrid gridOf(const std::vector<std::array<double, 3>>& centers, std::array<double, 3> scales,
                  float intensity = 1.0f) {
  StoredGrid grid;
  grid.descriptor.name = "density";
  grid.descriptor.gridClass = GridClass::kFogVolume;
  grid.descriptor.transform = uniformTransform(0.5);
  grid.field.chunks.resize(1);
  Ellipsoids& e = grid.field.chunks[0].ellipsoids;
  for (const auto& center : centers) {
    for (std::size_t a = 0; a < 3; ++a) {
      e.center[a].push_back(float(center[a]));
      e.logScale[a].push_back(float(std::log(scales[a])));
      e.rotation[a + 1].push_back(0.0f);
    }
    e.rotation[0].push_back(1.0f);
    e.intensity.push_back(intensity);
  }
  grid.activeBox = {{-20, -20, -20}, {19, 19, 19}};
  grid.valueMax = 100.0f;
  return grid;
}

SplatOptions whiteIn(SplatForm form, double densityScale) {
  return {
      .form = form, .colors = {.points = {{0.0, {1.0, 1.0, 1.0}}}}, .densityScale = densityScale};
}

/// The optical depth of splats, summed over a picture and averaged over all directions.
double depthOf(const Splats& splats) {
  double depth = 0.0;
  for (std::size_t i = 0; i < splats.size(); ++i)
    depth += 2.0 * std::numbers::pi * splats::depthOfAlpha(double(splats.alpha[i])) *
             splats::meanShadow({std::exp(double(splats.logScale[0][i])),
                                 std::exp(double(splats.logScale[1][i])),
                                 std::exp(double(splats.logScale[2][i]))});
  return depth;
}

TEST(MakeSplats, KeepTheOpticalDepthOfEllipsoids) {
  constexpr double kDensityScale = 0.3;
  for (const auto& scales : {std::array{4.0, 4.0, 4.0}, std::array{8.0, 3.0, 1.0}})
    for (const float intensity : {0.02f, 0.5f, 5.0f}) {
      const StoredGrid grid = gridOf({{0, 0, 0}}, scales, intensity);
      const auto made = makeSplats(grid, whiteIn(SplatForm::kMitsuba, kDensityScale));
      const double volume =
          splats::gaussianOf(grid.field.kernel, double(grid.field.kernel.kappa)).volume;
      const double wanted =
          kDensityScale * double(intensity) * volume * scales[0] * scales[1] * scales[2] / 8.0;
      // An alpha is written up to 0.002 of 255 too high.
      EXPECT_NEAR(depthOf(made.scene.splats), wanted, 2e-3 * wanted) << intensity;
    }
}

TEST(MakeSplats, LetThroughTheLightOfTheirDensity) {
  // A fog of many balls, seen through the middle along z.
  std::vector<std::array<double, 3>> centers;
  for (int x = -8; x <= 8; x += 4)
    for (int y = -8; y <= 8; y += 4)
      for (int z = -8; z <= 8; z += 4) centers.push_back({double(x), double(y), double(z)});
  const StoredGrid grid = gridOf(centers, {4.0, 4.0, 4.0}, 0.2f);
  constexpr double kDensityScale = 0.1;
  const auto made = makeSplats(grid, whiteIn(SplatForm::kMitsuba, kDensityScale));
  double depth = 0.0;
  for (int z = -40; z <= 40; ++z)
    depth += kDensityScale * 0.5 * evaluateReference(grid.field, {0, 0, z});
  double light = 1.0;
  const Splats& s = made.scene.splats;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const double size = std::exp(double(s.logScale[0][i]));
    const double r2 =
        double(s.center[0][i]) * s.center[0][i] + double(s.center[1][i]) * s.center[1][i];
    light *= 1.0 - double(s.alpha[i]) * std::exp(-0.5 * r2 / (size * size));
  }
  EXPECT_GT(depth, 0.5);
  EXPECT_NEAR(-std::log(light), depth, 0.05 * depth);
}

TEST(MakeSplats, HaveAlphasThatEightBitsKeep) {
  const auto made = makeSplats(gridOf({{0, 0, 0}, {9, 0, 0}}, {3.0, 2.0, 1.0}, 0.4f),
                               whiteIn(SplatForm::kPly, 2.0));
  for (const float alpha : made.scene.splats.alpha) {
    const double steps = 255.0 * double(alpha), rest = steps - std::floor(steps);
    EXPECT_GE(steps, 1.0);
    EXPECT_NEAR(rest, 0.002, 1e-4);
  }
}

TEST(MakeSplats, AreSeveralWhereOneWouldBeOpaque) {
  const StoredGrid grid = gridOf({{0, 0, 0}}, {4.0, 4.0, 4.0}, 1.0f);
  EXPECT_EQ(makeSplats(grid, whiteIn(SplatForm::kPly, 0.05)).scene.splats.size(), 1u);
  const auto deep = makeSplats(grid, whiteIn(SplatForm::kPly, 1.0));
  EXPECT_GT(deep.scene.splats.size(), 2u);
  EXPECT_LT(deep.scene.splats.alpha[0], 0.65f);
  EXPECT_EQ(makeSplats(grid, whiteIn(SplatForm::kPly, 1000.0)).scene.splats.size(), 16u);
}

TEST(MakeSplats, AreCenteredWithYDownForViewers) {
  StoredGrid grid = gridOf({{10, 5, -3}}, {2.0, 2.0, 2.0});
  const auto made = makeSplats(grid, whiteIn(SplatForm::kPly, 0.1));
  const Splats& s = made.scene.splats;
  // The box is 40 voxels of 0.5 wide around (-0.25, -0.25, -0.25), and 10 in the file: a half for each unit.
  EXPECT_NEAR(s.center[0][0], (5.0 + 0.25) / 2, 1e-6);
  EXPECT_NEAR(s.center[1][0], -(2.5 + 0.25) / 2, 1e-6);
  EXPECT_NEAR(s.center[2][0], -(-1.5 + 0.25) / 2, 1e-6);
  const auto& m = made.scene.toWorld;
  const std::array<double, 3> wanted{5.0, 2.5, -1.5};
  for (std::size_t r = 0; r < 3; ++r)
    EXPECT_NEAR(double(s.center[0][0]) * m[r] + double(s.center[1][0]) * m[4 + r] +
                    double(s.center[2][0]) * m[8 + r] + m[12 + r],
                wanted[r], 1e-6);
  const Splats inWorld = makeSplats(grid, whiteIn(SplatForm::kMitsuba, 0.1)).scene.splats;
  EXPECT_NEAR(inWorld.center[1][0], 2.5, 1e-6);
  EXPECT_NEAR(std::exp(inWorld.logScale[0][0]), 2.0 * std::exp(s.logScale[0][0]), 0.01);
}

TEST(MakeSplats, FollowAStretchedTransform) {
  StoredGrid grid = gridOf({{0, 0, 0}}, {2.0, 2.0, 2.0});
  grid.descriptor.transform = affineTransform({0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 4, 0, 7, 8, 9, 1});
  const Splats s = makeSplats(grid, whiteIn(SplatForm::kMitsuba, 0.01)).scene.splats;
  EXPECT_NEAR(s.center[2][0], 9.0, 1e-6);
  EXPECT_NEAR(s.logScale[0][0] - s.logScale[1][0], std::log(2.0),
              1e-5);  // the sizes decrease: 4, 2, 1
  EXPECT_NEAR(s.logScale[1][0] - s.logScale[2][0], std::log(2.0), 1e-5);
  const auto R =
      rotationOf({s.rotation[0][0], s.rotation[1][0], s.rotation[2][0], s.rotation[3][0]});
  EXPECT_NEAR(std::abs(R[6]), 1.0, 1e-6);  // the longest axis is z of the world
}

TEST(MakeSplats, HaveTheColorOfTheirValue) {
  const StoredGrid grid = gridOf({{0, 0, 0}}, {6.0, 6.0, 6.0}, 2.0f);
  SplatOptions options = whiteIn(SplatForm::kPly, 0.01);
  options.colors.points = {{0.0, {0.0, 0.0, 0.0}}, {2.0, {1.0, 0.5, 0.0}}};
  const Splats s = makeSplats(grid, options).scene.splats;
  EXPECT_GT(s.color[0][0], 0.6f);  // about 2, one standard deviation from the center less
  EXPECT_LT(s.color[0][0], 1.0f);
  EXPECT_NEAR(s.color[1][0], 0.5f * s.color[0][0], 1e-6);
  EXPECT_EQ(s.color[2][0], 0.0f);
}

TEST(MakeSplats, FollowClampsTonesThresholdsAndNegativeEllipsoids) {
  const auto expectDepth = [](const StoredGrid& grid) {
    constexpr double kDensityScale = 0.05, kVoxel = 0.125;
    double integral = 0.0;  // of the decoded voxels
    for (const float value : decodeGrid(grid).values) integral += double(value) * kVoxel;
    const auto made = makeSplats(grid, whiteIn(SplatForm::kMitsuba, kDensityScale));
    EXPECT_NEAR(depthOf(made.scene.splats), kDensityScale * integral,
                2e-3 * kDensityScale * integral);
    return made;
  };
  StoredGrid grid = gridOf({{0, 0, 0}}, {5.0, 5.0, 5.0}, 2.0f);
  expectDepth(grid);
  grid.valueMax = 1.0f;  // the sum is clamped to it
  expectDepth(grid);
  grid.valueMax = 100.0f;
  grid.activeThreshold = 0.5f;
  expectDepth(grid);
  grid.tone.scale = 0.5f;
  expectDepth(grid);
  StoredGrid less = gridOf({{0, 0, 0}, {4, 0, 0}}, {5.0, 5.0, 5.0}, 2.0f);
  less.field.chunks[0].ellipsoids.intensity[1] = -1.0f;
  EXPECT_EQ(expectDepth(less).negative, 1u);
}

TEST(MakeSplats, SayWhatTheyLeaveOut) {
  StoredGrid grid = gridOf({{0, 0, 0}, {12, 0, 0}}, {3.0, 3.0, 3.0});
  grid.field.chunks[0].ellipsoids.intensity[1] = 0.0005f;
  const auto made = makeSplats(grid, whiteIn(SplatForm::kPly, 0.1));
  EXPECT_EQ(made.scene.splats.size(), 1u);
  EXPECT_NEAR(made.faintShare, 0.0005, 1e-4);
  EXPECT_THROW((void)makeSplats(grid, whiteIn(SplatForm::kPly, 1e-6)), CannotConvert);
}

TEST(MakeSplats, RefuseEllipsoidsThatReachTooFarBeforeAnythingIsEvaluated) {
  StoredGrid grid = gridOf({{0, 0, 0}}, {3e4, 3e4, 3e4});
  grid.activeBox = {{-40000, -40000, -40000}, {40000, 40000, 40000}};
  SplatOptions options = whiteIn(SplatForm::kPly, 0.1);
  options.maxBytes = 1u << 30;
  EXPECT_THROW((void)makeSplats(grid, options), MemoryExceeded);
}

TEST(MakeSplats, LetHalfOfTheLightThroughUnlessToldOtherwise) {
  SplatOptions options = whiteIn(SplatForm::kPly, 1.0);
  options.densityScale.reset();
  const auto made = makeSplats(gridOf({{0, 0, 0}}, {6.0, 6.0, 6.0}), options);
  EXPECT_GT(made.scene.densityScale, 0.02);
  EXPECT_LT(made.scene.densityScale, 1.0);
}

TEST(MakeSplats, RefuseWhatHasNoSplatsAndNameTheWayOut) {
  const auto expectRefusal = [](const auto& change, const char* why) {
    StoredGrid grid = gridOf({{0, 0, 0}}, {3.0, 3.0, 3.0});
    change(grid);
    try {
      (void)makeSplats(grid, whiteIn(SplatForm::kPly, 0.1));
      ADD_FAILURE() << why;
    } catch (const CannotConvert& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
      EXPECT_THAT(error.what(), HasSubstr("\"density\""));
    }
  };
  expectRefusal([](StoredGrid& g) { g.voxels.emplace(); }, "vdb2esvr --representation ellipsoids");
  expectRefusal([](StoredGrid& g) { g.descriptor.gridClass = GridClass::kLevelSet; },
                "sdfToFogVolume");
  expectRefusal([](StoredGrid& g) { g.descriptor.background = 2.0; }, "background is 2");
  expectRefusal([](StoredGrid& g) { g.field.chunks.clear(); }, "no ellipsoids");
  expectRefusal([](StoredGrid& g) { g.descriptor.transform.affine.reset(); }, "frustum");
  EXPECT_THROW(
      (void)makeSplats(gridOf({{0, 0, 0}}, {3.0, 3.0, 3.0}), whiteIn(SplatForm::kPly, -1.0)),
      UsageError);
}

}  // namespace
}  // namespace esvr
