// Plan: the picture of a NanoVDB grid agrees with that of the same voxels marched in float64
// (renderVolume). Float32 positions have errors of 1e-5 voxel, so that a few samples fall into the
// next cell, and values have errors of 1e-5 of their range. Quantised values differ by half a step
// of 4, 8 or 16 bits of a leaf's range, which is up to 1 here. The cases have negative coordinates,
// empty space, bricks that touch at corners only, and a camera inside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"

namespace esvr::test {
namespace {

constexpr Box kNanoBox{{-20, -20, -20}, {59, 59, 59}};

VolumeGrid nanoBlobs(Coord origin = {-20, -20, -20}) {
  VolumeGrid grid;
  grid.descriptor.transform = uniformTransform(1.0);
  const Field field = randomField({.count = 30, .extent = 70.0, .smallest = 1.0, .origin = origin});
  grid.volume = revoxelise(field, {.threshold = 0.05f});
  return grid;
}

RenderOptions nanoOptions(const CameraWish& wish = {}) {
  RenderOptions o = pictureOf(kNanoBox, {70, 50}, 8.0, wish);
  o.lod = LevelOfDetail::kOff;
  return o;
}

void expectTheVolumesPicture(const VolumeGrid& grid, NanoValues values, const RenderOptions& o,
                             double tolerance) {
  const Image expected = renderVolume(grid.volume, o);
  expectAnyLight(expected);
  const NanoVolume nano = makeNanoVolume(grid, values);
  EXPECT_LE(largestDifference(makeNanoRenderer(nano, {DeviceKind::kCpu})->draw(o), expected),
            tolerance);
}

TEST(RenderNano, DrawsTheVolumesPicture) {
  for (const CameraWish& wish : {CameraWish{}, orthographic(), inside()})
    expectTheVolumesPicture(nanoBlobs(), NanoValues::kFloat, nanoOptions(wish), 1e-3);
}

TEST(RenderNano, AgreesForOtherSteps) {
  for (const double step : {0.3, 2.7}) {
    RenderOptions o = nanoOptions();
    o.step = step;
    expectTheVolumesPicture(nanoBlobs(), NanoValues::kFloat, o, 1e-3);
  }
}

TEST(RenderNano, StepsOverAllOfAFarEmptySpace) {
  VolumeGrid grid = nanoBlobs();
  auto bricks = bricksOf(grid.volume);
  std::ranges::move(bricksOf(nanoBlobs({5000, -20, -20}).volume), std::back_inserter(bricks));
  grid.volume = makeVolume(std::move(bricks), 0.0f);
  const RenderOptions o =
      nanoOptions({.eye = Vec3{-200, 20, 20}, .center = Vec3{0, 20, 20}, .fov = 20.0});
  expectTheVolumesPicture(grid, NanoValues::kFloat, o, 1e-3);
}

/// The background is a quantised value too, so it is not exactly empty; the opacity begins at it.
TEST(RenderNano, QuantisedValuesAreCloseBy) {
  VolumeGrid grid = nanoBlobs();
  for (float& v : grid.volume.values) v = std::abs(v);
  RenderOptions o = nanoOptions();
  o.transfer = rescaled(o.transfer, {0.0f, 1.0f});
  expectTheVolumesPicture(grid, NanoValues::kFp16, o, 2e-3);
  expectTheVolumesPicture(grid, NanoValues::kFp8, o, 0.02);
  expectTheVolumesPicture(grid, NanoValues::kFpN, o, 0.1);
  expectTheVolumesPicture(grid, NanoValues::kFp4, o, 0.2);
}

TEST(RenderNano, AnEmptyGridIsTransparent) {
  VolumeGrid grid;
  grid.descriptor.transform = uniformTransform(1.0);
  const NanoVolume nano = makeNanoVolume(grid, NanoValues::kFloat);
  expectTransparent(renderNano(nano, nanoOptions()));
}

}  // namespace
}  // namespace esvr::test
