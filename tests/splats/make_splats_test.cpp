// Plan: splats are made of fields whose optical depth has a closed form. A splat's depth, summed over a picture and
// averaged over directions, must be that of its ellipsoid; transmittances of composited splats are compared with
// integrals of the density. Colors, places and refusals are checked on single ellipsoids.
//
// The optics of Gaussians are compared with sums over fine lattices and with closed forms. Tolerances are
// those of the sums.
//
// The densities and colors at voxels are compared with sums of Gaussians in float64 by the definition. The
// tolerance is that of the cut of the Gaussians at a ten-thousandth of their height. The integral does not depend on
// the size of the voxels, also where splats are thinner than they. Hostile splats are refused before anything is
// evaluated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/geometry.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/resolution.h"
#include "esvr/splats.h"
#include "field/random_field.h"
#include "splats/gaussian.h"
#include "support/files.h"
#include "support/machine.h"

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

// ---- Gaussians

namespace esvr::splats {
namespace {

TEST(SplatGaussian, HasTheIntegralAndTheSecondMomentOfItsKernel) {
  for (const float kappa : {-20.0f, 0.0f, 2.0f, 12.0f}) {
    const Kernel kernel{.kappa = kappa};
    const auto c = kernelConstants<double>(kernel);
    const double end = supportRadius(c), step = end / 40.0;
    double integral = 0.0, second = 0.0;
    for (double x = -end + step / 2; x < end; x += step)
      for (double y = -end + step / 2; y < end; y += step)
        for (double z = -end + step / 2; z < end; z += step) {
          const double phi = kernelPhi(c, x * x + y * y + z * z) * step * step * step;
          integral += phi;
          second += phi * x * x;
        }
    const auto [width, volume] = gaussianOf(kernel, double(kappa));
    EXPECT_NEAR(volume, integral, 2e-3 * integral) << kappa;
    EXPECT_NEAR(width, std::sqrt(second / integral), 2e-3 * width) << kappa;
  }
}

TEST(SplatGaussian, HasAClosedFormOfItsOwnIntegral) {
  const Kernel kernel = gaussianKernel();
  const double volume = gaussianOf(kernel, double(kernel.kappa)).volume;
  EXPECT_NEAR(gaussianVolume(), 2.0 * std::numbers::sqrt2 * volume, 1e-6);
  EXPECT_NEAR(gaussianVolume(), std::pow(2.0 * std::numbers::pi, 1.5), 0.05);  // less the cut
}

TEST(SplatGaussian, CastsTheMeanShadowOfItsProjections) {
  EXPECT_DOUBLE_EQ(meanShadow({2.0, 2.0, 2.0}), 4.0);
  EXPECT_NEAR(meanShadow({1.0, 1.0, 0.0}), 0.5, 1e-12);  // a disk
  for (const Sizes& s : {Sizes{1.0, 2.0, 3.0}, Sizes{0.01, 1.0, 1.0}, Sizes{5.0, 0.2, 0.1}}) {
    constexpr int kRings = 400, kTurns = 400;
    double sum = 0.0;
    for (int i = 0; i < kRings; ++i)
      for (int j = 0; j < kTurns; ++j) {
        const double z = (i + 0.5) / kRings, r = std::sqrt(1.0 - z * z);
        const double angle = (j + 0.5) / kTurns * std::numbers::pi / 2.0;
        sum += std::hypot(s[1] * s[2] * r * std::cos(angle), s[0] * s[2] * r * std::sin(angle),
                          s[0] * s[1] * z);
      }
    EXPECT_NEAR(meanShadow(s), sum / (kRings * kTurns), 1e-4 * meanShadow(s));
  }
}

TEST(SplatGaussian, HasADepthThatIsTheDilogarithmOfItsAlpha) {
  EXPECT_EQ(depthOfAlpha(0.0), 0.0);
  EXPECT_NEAR(depthOfAlpha(1.0), std::numbers::pi * std::numbers::pi / 6.0, 1e-15);
  for (const double alpha : {1e-4, 0.3, 0.5, 0.7, 0.99}) {
    constexpr double kStep = 1e-3;
    double sum = 0.0;
    for (double t = kStep / 2; t < 40.0; t += kStep)
      sum -= std::log1p(-alpha * std::exp(-t)) * kStep;
    EXPECT_NEAR(depthOfAlpha(alpha), sum, 1e-5 * sum) << alpha;
  }
}

TEST(SplatGaussian, IsFoundFromTheColumnsOfItsMatrix) {
  const Quaternion turn = normalised({0.3, -0.5, 0.7, 0.1});
  const Matrix3 R = rotationOf(turn);
  const Sizes sizes{3.0, 1.0, 0.01};
  Matrix3 columns;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) columns[3 * r + c] = R[3 * r + c] * sizes[c];
  const auto found = principalAxesOf(columns);
  const Matrix3 axes = rotationOf(found.rotation);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double wanted = 0.0, covariance = 0.0;
      for (int k = 0; k < 3; ++k) {
        wanted += columns[3 * i + k] * columns[3 * j + k];
        covariance += axes[3 * i + k] * axes[3 * j + k] * found.sizes[k] * found.sizes[k];
      }
      EXPECT_NEAR(covariance, wanted, 1e-12);
    }
  EXPECT_NEAR(found.sizes[2], 0.01, 1e-10);
  EXPECT_NEAR(lengthOf(found.rotation), 1.0, 1e-12);
  EXPECT_GE(found.rotation[0], 0.0);
}

}  // namespace
}  // namespace esvr::splats

// ---- Grids

namespace esvr {
namespace {

SplatScene randomScene(std::size_t count, double smallest = 0.5) {
  SplatScene scene;
  // The world is twice as large, and z of the file is its y.
  scene.toWorld = {2, 0, 0, 0, 0, 0, -2, 0, 0, 2, 0, 0, 3, -4, 5, 1};
  scene.densityScale = 0.5;
  scene.splats.resize(count, true);
  test::Random random(11);
  Splats& s = scene.splats;
  for (std::size_t i = 0; i < count; ++i) {
    double q[4], norm = 0.0;
    for (double& v : q) v = random(-1.0, 1.0), norm += v * v;
    for (std::size_t a = 0; a < 4; ++a)
      s.rotation[a][i] = float((q[0] < 0 ? -q[a] : q[a]) / std::sqrt(norm));
    for (std::size_t a = 0; a < 3; ++a) {
      s.center[a][i] = float(random(-3.0, 3.0));
      s.logScale[a][i] = float(std::log(smallest) + random(0.0, 1.0));
      s.color[a][i] = float(random(0.0, 1.0));
    }
    s.alpha[i] = float(random(0.01, 0.99));
  }
  return scene;
}

/// The density and the colors times it at a place of the world, by the definition.
std::array<double, 4> referenceAt(const SplatScene& scene, const std::array<double, 3>& world) {
  const auto& m = scene.toWorld;
  std::array<double, 4> sums{};
  for (std::size_t i = 0; i < scene.splats.size(); ++i) {
    const Splats& s = scene.splats;
    std::array<double, 3> d{}, sizes{};
    for (std::size_t r = 0; r < 3; ++r) {
      d[r] = world[r] - m[12 + r];
      for (std::size_t c = 0; c < 3; ++c) d[r] -= double(s.center[c][i]) * m[4 * c + r];
      sizes[r] = std::exp(double(s.logScale[r][i]));
    }
    const Matrix3 R = rotationOf(
        normalised({s.rotation[0][i], s.rotation[1][i], s.rotation[2][i], s.rotation[3][i]}));
    double square = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      double along = 0.0;  // in the file, whose scale is 2
      for (int k = 0; k < 3; ++k) {
        double inFile = 0.0;
        for (int r = 0; r < 3; ++r) inFile += m[4 * k + r] * d[r] / 4.0;
        along += R[3 * k + axis] * inFile;
      }
      square += along * along / (sizes[axis] * sizes[axis]);
    }
    const double worldVolume = 8.0 * sizes[0] * sizes[1] * sizes[2];
    const double depth = 2.0 * std::numbers::pi * 4.0 * splats::meanShadow(sizes) *
                         splats::depthOfAlpha(double(s.alpha[i]));
    const double value = depth / (std::pow(2.0 * std::numbers::pi, 1.5) * worldVolume) *
                         std::exp(-0.5 * square) / scene.densityScale;
    sums[0] += value;
    for (std::size_t c = 0; c < 3; ++c) sums[1 + c] += value * double(s.color[c][i]);
  }
  return sums;
}

TEST(SplatGrids, HaveTheSumOfGaussiansAndTheirMeanColor) {
  const SplatScene scene = randomScene(40);
  const auto grids = makeSplatGrids(scene, {.voxelSize = 0.7});
  double highest = 0.0;
  for (const float v : grids.density.volume.values) highest = std::max(highest, double(v));
  int compared = 0;
  for (int i = -8; i <= 8; i += 2)
    for (int j = -8; j <= 8; j += 2)
      for (int k = -8; k <= 8; k += 2) {
        const Coord voxel{4 + i, -6 + j, 7 + k};
        const auto wanted = referenceAt(scene, {0.7 * voxel.x, 0.7 * voxel.y, 0.7 * voxel.z});
        const double value = valueAt(grids.density.volume, voxel);
        EXPECT_NEAR(value, wanted[0], 4e-3 * highest);
        if (!(wanted[0] > 0.05 * highest)) continue;
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(valueAt(grids.color->components[c], voxel), wanted[1 + c] / wanted[0], 0.02);
        ++compared;
      }
  EXPECT_GT(compared, 100);
  EXPECT_EQ(grids.density.descriptor.name, "density");
  EXPECT_EQ(grids.color->descriptor.name, "Cd");
  EXPECT_EQ(grids.density.descriptor.gridClass, GridClass::kFogVolume);
}

TEST(SplatGrids, HaveTheColorItselfWhereAllSplatsHaveIt) {
  SplatScene scene = randomScene(12);
  for (auto& channel : scene.splats.color) std::ranges::fill(channel, 0.7f);
  const SplatGrids grids = makeSplatGrids(scene, {.voxelSize = 0.7});
  for (const SparseVolume& channel : grids.color->components) {
    const ValueRange range = activeRange(channel);
    EXPECT_EQ(range.min, 0.7f);
    EXPECT_EQ(range.max, 0.7f);
  }
}

/// The sum of the values, and the mean square of the distance from their middle in voxels.
struct Moments {
  double sum = 0.0, square = 0.0;

  explicit Moments(const SparseVolume& volume) {
    std::array<double, 3> first{};
    double second = 0.0;
    const auto corners = brickCorners(volume);
    for (std::size_t b = 0; b < volume.brickCount(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v) {
        const Coord at = corners[b] + voxelLocal(v);
        const double value = volume.brickValues(b)[std::size_t(v)];
        sum += value;
        first[0] += value * at.x, first[1] += value * at.y, first[2] += value * at.z;
        second += value * (double(at.x) * at.x + double(at.y) * at.y + double(at.z) * at.z);
      }
    square = second / sum;
    for (const double f : first) square -= f / sum * f / sum;
  }
};

TEST(SplatGrids, HaveTheGaussiansOfTheGridFromWhichTheirSplatsWereMade) {
  for (const auto& scales : {std::array{8.0, 8.0, 8.0}, std::array{9.0, 6.0, 4.0}})
    for (const double densityScale : {0.02, 0.3, 1.5}) {  // up to a depth of 9
      SCOPED_TRACE(densityScale);
      StoredGrid grid = gridOf({{0.3, -0.2, 0.1}}, scales);
      grid.activeBox = {{-40, -40, -40}, {39, 39, 39}};
      grid.field.kernel = splats::gaussianKernel();
      const SparseVolume source = decodeGrid(grid);
      const SplatScene scene = makeSplats(grid, whiteIn(SplatForm::kPly, densityScale)).scene;
      const SplatGrids back = makeSplatGrids(scene);
      EXPECT_EQ(back.voxelSize, 0.5);
      EXPECT_EQ(back.density.descriptor.transform.affine, grid.descriptor.transform.affine);
      const Moments wanted(source), found(back.density.volume);
      EXPECT_NEAR(found.sum, wanted.sum, 0.01 * wanted.sum);
      // Gaussians are cut in the source, and again at the voxels; without the growth of sizes undone, these figures
      // are off by up to 12 and 18 %.
      EXPECT_NEAR(std::sqrt(found.square / wanted.square), 1.0, 0.012);
      EXPECT_NEAR(std::ranges::max(back.density.volume.values) / std::ranges::max(source.values),
                  1.0, 0.025);
    }
}

TEST(SplatGrids, AreMadeOfSplatsOfTinyVoxels) {
  const test::TemporaryFolder folder;
  StoredGrid grid = gridOf({{0, 0, 0}}, {6.0, 5.0, 4.0});
  for (const double size : {2.0, 1e-4, 2.5e-5, 1e-6}) {
    (*grid.descriptor.transform.affine) = {size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, 0, 0, 0, 1};
    const auto made = makeSplats(grid, whiteIn(SplatForm::kPly, 0.1 / size));
    writeSplats(folder / "tiny.ply", made.scene, SplatForm::kPly, true);
    const SplatScene back = readSplats(folder / "tiny.ply").scene;
    EXPECT_EQ(back.indexToWorld.has_value(), size > 2.2e-5) << size;
    EXPECT_EQ(makeSplatGrids(back, {.voxelSize = std::max(size, 2e-5)}).density.descriptor.name,
              "density")
        << size;
  }
}

TEST(SplatGrids, AreOnTheLatticeOfTheGridFromWhichTheirSplatsWereMade) {
  StoredGrid grid = gridOf({{0, 0, 0}, {6, -3, 2}}, {6.0, 5.0, 4.0}, 0.2f);
  grid.field.kernel = splats::gaussianKernel();
  // Turned, stretched and sheared voxels.
  grid.descriptor.transform =
      affineTransform({0, 0.2, 0, 0, -0.1, 0, 0, 0, 0, 0.05, 0.3, 0, 7, 8, 9, 1});
  const SparseVolume source = decodeGrid(grid);
  const SplatScene scene = makeSplats(grid, whiteIn(SplatForm::kPly, 0.5)).scene;
  const SplatGrids same = makeSplatGrids(scene), other = makeSplatGrids(scene, {.voxelSize = 0.2});
  EXPECT_EQ(same.density.descriptor.transform.affine, grid.descriptor.transform.affine);
  EXPECT_EQ(same.voxelSize, 0.1);
  const float highest = std::ranges::max(source.values);
  for (const Coord at : {Coord{0, 0, 0}, Coord{5, 1, 0}, Coord{-3, -4, 2}, Coord{6, -3, 5}})
    EXPECT_NEAR(valueAt(same.density.volume, at), valueAt(source, at), 0.02f * highest);
  const auto wanted = transformAt(grid.descriptor.transform, 2.0);
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR((*other.density.descriptor.transform.affine)[i], (*wanted.affine)[i], 1e-12);
  EXPECT_NEAR(Moments(other.density.volume).sum * 8.0, Moments(same.density.volume).sum,
              0.01 * Moments(same.density.volume).sum);
}

double integralOf(const SplatGrids& grids) {
  double sum = 0.0;
  for (const float v : grids.density.volume.values) sum += double(v);
  return sum * grids.voxelSize * grids.voxelSize * grids.voxelSize;
}

TEST(SplatGrids, HaveTheSameIntegralForAnySizeOfVoxels) {
  const SplatScene scene = randomScene(25, 0.2);
  const double wanted = integralOf(makeSplatGrids(scene, {.voxelSize = 0.2}));
  for (const double size : {0.3, 0.6, 1.2, 2.4})
    EXPECT_NEAR(integralOf(makeSplatGrids(scene, {.voxelSize = size})), wanted, 0.01 * wanted)
        << size;
  EXPECT_GT(makeSplatGrids(scene, {.voxelSize = 2.4}).thickened, 0u);
}

TEST(SplatGrids, DivideByTheDensityScale) {
  const SplatScene scene = randomScene(5);
  const double one = integralOf(makeSplatGrids(scene, {.voxelSize = 0.5}));
  EXPECT_NEAR(integralOf(makeSplatGrids(scene, {.voxelSize = 0.5, .densityScale = 0.25})),
              2.0 * one, 1e-3 * one);
}

TEST(SplatGrids, HaveTheSameBitsOnAnyNumberOfThreads) {
  const SplatScene scene = randomScene(60);
  test::expectSameOnAnyThreads(
      [&] { return makeSplatGrids(scene, {.voxelSize = 0.4}).density.volume.values; });
}

TEST(SplatGrids, HaveAbout256VoxelsAlongTheirLongestSide) {
  SplatScene scene = randomScene(200, 0.02);
  scene.splats.center[0][0] = 1e6f;  // a stray one
  const auto grids = makeSplatGrids(scene);
  EXPECT_NEAR(grids.voxelSize, 12.0 / 256.0, 0.5 / 256.0);  // the outermost centers do not count
}

TEST(SplatGrids, RefuseWhatNoGridCanHold) {
  SplatScene scene = randomScene(3);
  EXPECT_THROW((void)makeSplatGrids(scene, {.voxelSize = 0.0}), UsageError);
  EXPECT_THROW((void)makeSplatGrids(randomScene(60), {.voxelSize = 0.1, .maxBytes = 40u << 20}),
               MemoryExceeded);
  scene.splats.center[1][1] = 1e12f;
  EXPECT_THROW((void)makeSplatGrids(scene, {.voxelSize = 0.5}),
               BadInput);  // beyond the index space
  scene = randomScene(3);
  scene.splats.logScale[2][1] = 15.0f;
  scene.splats.logScale[1][1] = 15.0f;
  EXPECT_THROW((void)makeSplatGrids(scene, {.voxelSize = 0.5, .maxBytes = 1u << 30}),
               BadInput);  // a huge one
  scene = randomScene(3);
  for (float& alpha : scene.splats.alpha) alpha = 1e-9f;
  EXPECT_THROW((void)makeSplatGrids(scene, {.voxelSize = 0.5}), BadInput);  // nothing is active
}

}  // namespace
}  // namespace esvr
