// Plan: the densities and colors at voxels are compared with sums of Gaussians in float64 by the definition. The
// tolerance is that of the cut of the Gaussians at a ten-thousandth of their height. The integral does not depend on
// the size of the voxels, also where splats are thinner than they. Hostile splats are refused before anything is
// evaluated.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/geometry.h"
#include "esvr/error.h"
#include "esvr/splats.h"
#include "field/random_field.h"
#include "splats/gaussian.h"
#include "support/on_threads.h"

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
  const auto values = [&] {
    const auto grids = makeSplatGrids(scene, {.voxelSize = 0.4});
    return std::vector<float>(grids.density.volume.values.begin(),
                              grids.density.volume.values.end());
  };
  EXPECT_EQ(test::onThreads(1, values), test::onThreads(4, values));
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
