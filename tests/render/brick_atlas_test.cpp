// Plan: marching through bricks of cells agrees with renderVolume, which reads the same voxels
// through neighbouring bricks. Positions are float32 here, with errors of 1e-5 voxel, so that a few
// samples fall into the next cell, whose value is nearly the same. The cases are bricks that are
// apart, touch or have negative positions, and empty blocks between them.
#include "render/brick_atlas.h"

#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/field.h"
#include "render/brick_scene.h"
#include "render/picture.h"
#include "render/reference_picture.h"

namespace esvr::test {
namespace {

PixelColor rayColor(const BrickTableView& table, const BrickSlotsView& slots,
                    const MarchScene& scene, const MarchSamples& samples) {
  RayProgress ray;
  AllBricksAreThere visitor;
  EXPECT_TRUE(marchBricks(table, slots, scene, samples, ray, visitor));
  return scene.rule.finished(ray.ray);
}

SparseVolume volumeAt(const std::vector<Coord>& corners, float background = 0.0f) {
  return randomBricks(corners, 5, background);
}

Image marched(const SparseVolume& volume, const RenderOptions& o) {
  const BrickAtlas atlas = makeBrickAtlas(volume);
  Picture picture(o);
  const auto pages = atlas.pages();
  const Coord origin = atlas.table.origin;
  View view = picture.view;
  view.eye = difference(view.eye, {double(origin.x), double(origin.y), double(origin.z)});
  const MarchScene scene{view, cellsOf(atlas.table), o.step, clipOf(o),
                         sampleRule(o, picture.table.view(), volume.background)};
  for (int row = 0; row < o.resolution.height; ++row)
    for (int column = 0; column < o.resolution.width; ++column)
      picture.set(column, row,
                  rayColor(atlas.table.view(), {nullptr, pages.data()}, scene,
                           samplesOf(scene, column, row, SampleRange::all())));
  return picture.take();
}

void expectTheVolumesPicture(const SparseVolume& volume, const CameraWish& wish = {}) {
  for (const double step : {0.4, 1.0, 3.0}) {
    RenderOptions o = optionsFor(volume, wish);
    o.step = step;
    EXPECT_LE(largestDifference(marched(volume, o), renderVolume(volume, o)), 1e-3) << step;
  }
}

TEST(BrickAtlas, MarchesToTheVolumesPicture) {
  const auto volume = volumeAt({{0, 0, 0}, {0, 0, 8}, {8, 8, 8}, {40, 0, 16}, {-16, 40, -32}});
  expectTheVolumesPicture(volume);
  expectTheVolumesPicture(volume, {.projection = Projection::kOrthographic});
  expectTheVolumesPicture(volume,
                          {.eye = Vec3{9, 10, 11}, .center = Vec3{40, 12, 20}, .fov = 90.0});
}

TEST(BrickAtlas, StepsOverBlocksThatAreNotThere) {
  expectTheVolumesPicture(volumeAt({{0, 0, 0}, {700, 8, 16}, {704, 8, 16}, {344, -640, 0}}));
}

TEST(BrickAtlas, KnowsItsBackground) {
  expectTheVolumesPicture(volumeAt({{0, 0, 0}, {16, 0, 0}}, 0.25f));
}

TEST(BrickAtlas, HoldsEveryCellThatShowsAnythingAndNoOthers) {
  SparseVolume volume = volumeAt({{0, 0, 0}});
  EXPECT_EQ(makeBrickAtlas(volume).table.bricks.size(), 8u) << "cells reach one voxel below";
  std::fill(volume.values.begin(), volume.values.end(), 0.0f);
  volume.values[std::size_t(voxelOffset({3, 3, 3}))] = 1.0f;
  EXPECT_EQ(makeBrickAtlas(volume).table.bricks.size(), 1u);
  volume.values[std::size_t(voxelOffset({0, 3, 3}))] = 1.0f;
  EXPECT_EQ(makeBrickAtlas(volume).table.bricks.size(), 2u);
  EXPECT_TRUE(makeBrickAtlas(SparseVolume{}).table.bricks.empty());
}

TEST(BrickAtlas, RefusesVoxelsTooFarApart) {
  const auto volume = volumeAt({{0, 0, 0}, {1 << 20, 1 << 20, 1 << 20}});
  EXPECT_THROW((void)makeBrickAtlas(volume), UsageError);
}

}  // namespace
}  // namespace esvr::test
