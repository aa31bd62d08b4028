// Plan: voxels of coarser levels are means. A picture whose pixels are wide is that of the coarser
// volume, drawn for itself. Where a ray passes from level to level, nothing is lost or counted twice:
// a homogeneous medium looks the same with and without levels. The pictures of a field's cells, which
// average brick by brick, agree with those of averaged volumes. Pictures are closer to those with
// many rays a pixel than without levels.
#include "render/level_of_detail.h"

#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "render/brick_scene.h"
#include "render/reference_picture.h"
#include "render/voxel_levels.h"

namespace esvr::test {
namespace {

SparseVolume noise() {
  return randomBricks({{-16, 8, 0}, {-8, 8, 0}, {0, 0, 0}, {8, 0, 0}, {8, 8, 8}, {40, -24, 16}}, 3,
                      0.25f);
}

/// The mean of the voxels that a voxel of a coarser level stands for.
double meanOfCube(const SparseVolume& volume, Coord voxel, int side) {
  double sum = 0.0;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) sum += double(valueAt(volume, voxel * side + Coord{x, y, z}));
  return sum / (double(side) * side * side);
}

TEST(LevelOfDetail, HasMeansOfVoxels) {
  const SparseVolume volume = noise();
  VolumeLevels levels(volume);
  levels.prepare(3);
  for (const int level : {1, 2, 3})
    for (int x = -3; x < 7; ++x)
      for (int y = -4; y < 4; ++y)
        for (int z = -2; z < 4; ++z)
          // Each of three means of eight rounds to 1e-7.
          EXPECT_NEAR(valueAt(levels[level], {x, y, z}), meanOfCube(volume, {x, y, z}, 1 << level),
                      5e-7);
  EXPECT_NO_THROW(checkInvariants(levels[2]));
  EXPECT_EQ(coarserVolume(SparseVolume{}).bricks.size(), 0u);
}

TEST(LevelOfDetail, MeansOfEqualValuesAreThatValue) {
  for (const float v : {0.1f, -7e-30f, 3e38f}) {
    const float eight[] = {v, v, v, v, v, v, v, v};
    EXPECT_EQ(meanOf(eight), v) << "empty space stays empty";
  }
}

RenderOptions orthographic(const SparseVolume& volume) {
  RenderOptions o = optionsFor(volume, {.projection = Projection::kOrthographic});
  o.lod = LevelOfDetail::kAuto;
  return o;
}

TEST(LevelOfDetail, WidePixelsShowTheCoarserVolume) {
  const SparseVolume volume = noise();
  VolumeLevels levels(volume);
  levels.prepare(3);
  for (const int level : {1, 2, 3}) {
    RenderOptions o = orthographic(volume), own = o;
    const LevelFrame frame{level};
    o.resolution = own.resolution = {20, 20};
    o.camera.height = 20.0 * 3.5 * frame.side();  // a pixel is 3.5 voxels of the level wide
    own.camera.height = o.camera.height / frame.side();
    own.camera.eye = frame.place(o.camera.eye), own.camera.center = frame.place(o.camera.center);
    own.opacityLength = o.opacityLength / frame.side();
    own.lod = LevelOfDetail::kOff;
    EXPECT_GE(imagePsnr(renderVolume(volume, o), renderVolume(levels[level], own)), 100.0);
    o.lod = LevelOfDetail::kOff;
    EXPECT_LT(imagePsnr(renderVolume(volume, o), renderVolume(levels[level], own)), 60.0);
  }
}

/// A camera whose pixels grow from a part of a voxel to eighty voxels.
RenderOptions manyLevels() {
  RenderOptions o;
  o.resolution = {16, 12};
  o.camera = {.eye = {13, 11, -20}, .center = {12, 14, 100}, .up = {0, 1, 0}, .fov = 120.0};
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 40.0;
  return o;
}

/// A cube of 128^3 voxels that has one value in front of z = 64 and another behind.
SparseVolume halves(float front, float behind) {
  std::vector<BrickInput> bricks;
  for (int n = 0; n < 16 * 16 * 16; ++n) {
    BrickInput brick{Coord{n / 256, n / 16 % 16, n % 16} * kBrickSide, {}, {}};
    brick.values.fill(brick.corner.z < 64 ? front : behind);
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 0.0f);
}

TEST(LevelOfDetail, RaysPassFromLevelToLevelWithoutASeam) {
  const SparseVolume volume = halves(0.7f, 0.7f);
  for (const auto classification : {Classification::kPreIntegrated, Classification::kPost})
    for (const double step : {1.0, 0.7}) {
      RenderOptions o = manyLevels();
      o.camera.eye = {64, 64, 1};  // rays begin in the volume, and all end in it or at its far side
      o.camera.center = {60, 66, 100};
      o.step = step;
      o.opacityLength = 300.0;
      o.minTransmittance = 0.0;
      o.classification = classification;
      RenderOptions without = o;
      without.lod = LevelOfDetail::kOff;
      // At the far side, half a voxel of level 3 may be less or more, at 1/300 a voxel. A segment
      // that is lost or counted twice at each of three seams costs 14 voxels.
      const Image image = renderVolume(volume, o);
      EXPECT_GT(image.rgba[3], 0.05f) << "an empty picture proves nothing";
      EXPECT_LE(largestDifference(image, renderVolume(volume, without)), 0.025);
    }
}

TEST(LevelOfDetail, TheMeanOfARayCountsLengths) {
  const SparseVolume volume = halves(0.9f, 0.1f);
  RenderOptions o = manyLevels();
  o.mode = RenderMode::kAverage;
  o.camera.eye = {64, 64, 1}, o.camera.center = {64, 64, 100};
  o.resolution = {15, 15};
  o.transfer.opacity = {{0.0, 0.0}, {1.0, 1.0}};
  const std::size_t alpha = 4 * (7 * 15 + 7) + 3;  // of the middle pixel
  const float mean = renderVolume(volume, o).rgba[alpha];
  // The ramps of the coarsest level are up to 8 voxels long, of 127. By the number of samples, which
  // are closer in front, the mean would be above 0.7.
  EXPECT_NEAR(mean, 0.5, 0.05);
}

TEST(LevelOfDetail, CellsAndVolumesAgree) {
  const Field field = randomField({.count = 300, .extent = 120.0});
  const SparseVolume volume = revoxelise(field, {});
  for (const auto mode :
       {RenderMode::kComposite, RenderMode::kAverage, RenderMode::kMaximum, RenderMode::kDepth}) {
    RenderOptions o = manyLevels();
    o.mode = mode;
    if (mode != RenderMode::kComposite) o.opacityLength = 5.0;
    const Image cells = renderField(field, o);
    EXPECT_GE(imagePsnr(renderVolume(volume, o), cells), 80.0) << int(mode);
    o.lod = LevelOfDetail::kOff;
    EXPECT_LT(imagePsnr(renderVolume(volume, o), cells), 60.0) << "levels must be at work";
  }
}

TEST(LevelOfDetail, PicturesAreCloserToThoseWithManyRays) {
  std::vector<Coord> corners;
  for (int n = 0; n < 512; ++n) corners.push_back(Coord{n / 64, n / 8 % 8, n % 8} * kBrickSide);
  const SparseVolume volume = randomBricks(corners, 7);
  RenderOptions o = orthographic(volume);
  o.resolution = {12, 12};
  o.camera.height = 72.0;
  // Light grows with the value, so that the light of a mean is the mean of the light.
  o.transfer.colors = builtInColorMap("grayscale");
  for (ColorPoint& point : o.transfer.colors.points) point.color = {1.0, 1.0, 1.0};
  o.transfer.opacity = builtInOpacity("linear");
  o.opacityLength = 100.0;
  RenderOptions many = o;
  many.lod = LevelOfDetail::kOff;
  const Image without = renderVolume(volume, many);
  many.resolution = {96, 96};
  const Image expected = meansOfSquares(renderVolume(volume, many), 8);
  EXPECT_GE(imagePsnr(expected, renderVolume(volume, o)), imagePsnr(expected, without) + 3.0);
}

TEST(LevelOfDetail, AThinClipBoxIsNotMissed) {
  const SparseVolume volume = noise();
  RenderOptions o = orthographic(volume), without = o;
  o.camera.height = without.camera.height = 1000.0;
  o.clip = without.clip = PlaceBox{{-100, -100, 3.0}, {100, 100, 4.5}};
  without.lod = LevelOfDetail::kOff;
  EXPECT_EQ(renderVolume(volume, o).rgba, renderVolume(volume, without).rgba);
}

TEST(LevelOfDetail, MeansOfSquaresNeedWholeSquares) {
  const Image image{4, 2, std::vector<float>(32, 0.5f)};
  EXPECT_EQ(meansOfSquares(image, 2).rgba, std::vector<float>(8, 0.5f));
  EXPECT_THROW((void)meansOfSquares(image, 3), UsageError);
  EXPECT_THROW((void)meansOfSquares(image, 0), UsageError);
}

}  // namespace
}  // namespace esvr::test
