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
  Picture picture(o, kNoPlaces);
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

/// Notes the bricks that a ray asks for, and lets it look for `ahead` more.
struct Asking {
  std::vector<std::uint32_t>& asked;
  int ahead;
  void entered(std::uint32_t) const {}
  bool wantsMore(std::uint32_t brick, std::uint32_t) {
    asked.push_back(brick);
    return ahead-- > 0;
  }
};

/// The color of a ray that meets only missing bricks. Those that it asks for are given slots, and it
/// continues. \return also how often it had to wait
std::pair<PixelColor, int> colorWithWaits(const BrickAtlas& atlas, const MarchScene& scene,
                                          const MarchSamples& samples, int ahead) {
  std::vector<std::uint32_t> slotOf(atlas.table.bricks.size(), BrickSlotsView::kMissing), asked;
  const auto pages = atlas.pages();
  RayProgress ray;
  for (int waits = 0;; ++waits) {
    Asking asking{asked, ahead};
    if (marchBricks(atlas.table.view(), BrickSlotsView{slotOf.data(), pages.data()}, scene, samples,
                    ray, asking))
      return {scene.rule.finished(ray.ray), waits};
    for (const std::uint32_t brick : asked) slotOf[brick] = brick;
  }
}

TEST(BrickAtlas, RaysThatWaitForBricksHaveTheSameBits) {
  const auto volume = volumeAt({{0, 0, 0}, {8, 0, 0}, {16, 0, 0}, {24, 0, 0}, {40, 0, 0}});
  const BrickAtlas atlas = makeBrickAtlas(volume);
  const auto pages = atlas.pages();
  RenderOptions o = optionsFor(volume, {.eye = Vec3{100, 5, 4}, .center = Vec3{0, 4, 4}});
  o.minTransmittance = 0.0;
  const Picture picture(o, kNoPlaces);
  MarchScene scene{picture.view, cellsOf(atlas.table), o.step, clipOf(o),
                   sampleRule(o, picture.table.view(), volume.background)};
  const Coord origin = atlas.table.origin;
  scene.view.eye =
      difference(scene.view.eye, {double(origin.x), double(origin.y), double(origin.z)});
  const auto samples =
      samplesOf(scene, o.resolution.width / 2, o.resolution.height / 2, SampleRange::all());
  const PixelColor expected = rayColor(atlas.table.view(), {nullptr, pages.data()}, scene, samples);
  EXPECT_GT(expected.alpha, 0.1f);
  int waitsBefore = 1000;
  for (const int ahead : {0, 1, 100}) {
    const auto [color, waits] = colorWithWaits(atlas, scene, samples, ahead);
    EXPECT_EQ((std::array<float, 4>{color.r, color.g, color.b, color.alpha}),
              (std::array<float, 4>{expected.r, expected.g, expected.b, expected.alpha}));
    EXPECT_LT(waits, waitsBefore);
    waitsBefore = waits;
  }
  EXPECT_EQ(waitsBefore, 1) << "all bricks of the ray are found while it waits for the first";
}

// A tile knows in which samples its rays may meet bricks. This must not move the samples.
TEST(BrickAtlas, SamplesDoNotDependOnTheRangeThatIsWanted) {
  const auto volume = volumeAt({{0, 0, 0}, {40, 0, 16}});
  RenderOptions o = optionsFor(volume);
  o.step = 0.25;
  const Picture picture(o, kNoPlaces);
  const MarchScene scene{picture.view,
                         {{0, 0, 0}, {48, 8, 24}},
                         o.step,
                         clipOf(o),
                         sampleRule(o, picture.table.view(), volume.background)};
  const int column = o.resolution.width / 2, row = o.resolution.height / 2;
  const MarchSamples all = samplesOf(scene, column, row, SampleRange::all());
  ASSERT_GT(all.end, 10);
  const SampleRange some{all.number + 3.0, all.number + 8.0};
  const MarchSamples part = samplesOf(scene, column, row, some);
  EXPECT_EQ(part.first.x, all.first.x);
  EXPECT_EQ(part.begin, 3);
  EXPECT_EQ(part.end, 9);
}

TEST(BrickAtlas, RefusesVoxelsTooFarApart) {
  const auto volume = volumeAt({{0, 0, 0}, {1 << 20, 1 << 20, 1 << 20}});
  EXPECT_THROW((void)makeBrickAtlas(volume), UsageError);
}

}  // namespace
}  // namespace esvr::test
