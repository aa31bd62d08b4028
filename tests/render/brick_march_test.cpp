// Plan: marching through bricks of cells agrees with renderVolume, which reads the same voxels
// through neighbouring bricks. Positions are float32 here, with errors of 1e-5 voxel, so that a few
// samples fall into the next cell, whose value is nearly the same.
//
// A ray that waits for bricks is replaced by what is kept of it. Its color must have the bits of a
// march through bricks that are all there.
//
// Voxels of coarser levels are means. Where a ray passes from level to level, nothing is lost or
// counted twice: a homogeneous medium looks the same with and without levels.
#include "render/brick_march.h"

#include <gtest/gtest.h>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "render/cell_bricks.h"
#include "render/grids_march.h"
#include "render/picture.h"
#include "render/reference_picture.h"
#include "render/scenes.h"

namespace esvr::test {
namespace {

// Bricks that are all there.

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
    // Rounding may decide otherwise whether a segment with a bend at the limit is divided.
    EXPECT_LE(largestDifference(marched(volume, o), renderVolume(volume, o)), 1.0 / 64.0) << step;
    EXPECT_GE(imagePsnr(renderVolume(volume, o), marched(volume, o)), 70.0) << step;
  }
}

TEST(BrickAtlas, MarchesToTheVolumesPicture) {
  const auto volume = volumeAt({{0, 0, 0}, {0, 0, 8}, {8, 8, 8}, {40, 0, 16}, {-16, 40, -32}});
  expectTheVolumesPicture(volume);
  expectTheVolumesPicture(volume, orthographic());
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

// Rays that wait for bricks.

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

/// The color of a ray that meets only missing bricks. Those that it asks for are given slots, and
/// it continues. \return also how often it had to wait
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

/// Bricks that are there after a ray has asked for them.
struct AppearingSlots {
  std::vector<std::uint32_t> slotOf;
  BrickSlotsView all;

  [[nodiscard]] std::uint32_t slot(std::uint32_t brick) const { return slotOf[brick]; }
  [[nodiscard]] static bool hasSlot(std::uint32_t slot) { return BrickSlotsView::hasSlot(slot); }
  [[nodiscard]] const float* values(std::uint32_t slot) const { return all.values(slot); }
};

/// Brings the brick at which a ray waits.
struct Bringing {
  std::vector<AppearingSlots>& slots;

  void entered(std::uint32_t) const {}
  void entered(int, std::uint32_t) const {}
  [[nodiscard]] bool wantsMore(std::uint32_t brick, std::uint32_t) const {
    return wantsMore(0, brick, 0);
  }
  [[nodiscard]] bool wantsMore(int grid, std::uint32_t brick, std::uint32_t) const {
    slots[std::size_t(grid)].slotOf[brick] = brick;
    return false;
  }
};

/// A volume with bricks side by side and with gaps between them, on one diagonal.
struct Bricks {
  explicit Bricks(std::uint64_t seed)
      : volume(randomBricks({{0, 0, 0}, {0, 0, 8}, {8, 8, 8}, {8, 8, 16}, {24, 24, 24}}, seed)),
        atlas(makeBrickAtlas(volume)),
        pages(atlas.pages()) {}

  [[nodiscard]] BrickSlotsView all() const { return {nullptr, pages.data()}; }
  [[nodiscard]] AppearingSlots none() const {
    return {std::vector(atlas.table.bricks.size(), BrickSlotsView::kMissing), all()};
  }
  [[nodiscard]] MarchScene march(const RenderOptions& o, const TransferTableView& table) const {
    MarchScene scene = sceneOfLevel(
        marchScene(o, View(o.camera, o.resolution), sampleRule(o, table, volume.background)),
        LevelFrame{0}, atlas.table.origin);
    scene.box = cellsOf(atlas.table);
    return scene;
  }

  SparseVolume volume;
  BrickAtlas atlas;
  std::vector<const float*> pages;
};

bool equal(const PixelColor& a, const PixelColor& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.alpha == b.alpha;
}

/// Compares all pixels of a picture. \return how often rays waited
int compareRays(const RenderOptions& o) {
  const Bricks scene(5);
  const TransferTable table(o.transfer, samplingOf(o));
  const MarchScene march = scene.march(o, table.view());
  int waited = 0;
  for (int row = 0; row < o.resolution.height; ++row)
    for (int column = 0; column < o.resolution.width; ++column) {
      const MarchSamples samples = samplesOf(march, column, row, SampleRange::all());
      RayProgress whole, ray;
      AllBricksAreThere there;
      EXPECT_TRUE(marchBricks(scene.atlas.table.view(), scene.all(), march, samples, whole, there));
      std::vector<AppearingSlots> slots{scene.none()};
      Bringing bringing{slots};
      while (!marchBricks(scene.atlas.table.view(), slots[0], march, samples, ray, bringing)) {
        ray = KeptRay::of(ray).progress(channelsOf(ray));
        ++waited;
      }
      EXPECT_TRUE(equal(march.rule.finished(ray.ray), march.rule.finished(whole.ray)));
    }
  return waited;
}

TEST(KeptRay, GoesOnAsIfItHadNotWaited) {
  RenderOptions o = optionsFor(Bricks(5).volume);
  for (const RenderMode mode :
       {RenderMode::kComposite, RenderMode::kMaximum, RenderMode::kAverage, RenderMode::kDepth})
    for (const Classification c : {Classification::kPreIntegrated, Classification::kPost})
      for (const double minTransmittance : {0.0, 0.5}) {
        o.mode = mode, o.classification = c, o.minTransmittance = minTransmittance;
        EXPECT_GT(compareRays(o), 100);
      }
}

TEST(KeptRay, HasEnded) {
  EXPECT_LT(KeptRay::ended().next, 0);
  EXPECT_LT(KeptGridsRay::ended().next, 0);
}

TEST(KeptGridsRay, GoesOnAsIfItHadNotWaited) {
  const Bricks first(5), second(6);
  RenderOptions o = optionsFor(first.volume);
  const TransferTable table(o.transfer, samplingOf(o));
  GridsScene scene{first.march(o, table.view()), {}};
  const GridInScene grid{first.atlas.table.view(), table.view(), 0.0f, true, {0, 0, 0}};
  scene.grids[0] = scene.grids[1] = grid;
  scene.grids[1].absorbs = false;
  const BrickSlotsView all[] = {first.all(), second.all()};
  int waited = 0;
  for (int row = 0; row < o.resolution.height; ++row)
    for (int column = 0; column < o.resolution.width; ++column) {
      const MarchSamples samples = samplesOf(scene.scene, column, row, SampleRange::all());
      GridsProgress whole, ray;
      AllGridsAreThere there;
      EXPECT_TRUE(marchGrids<2>(scene, all, samples, whole, there));
      std::vector<AppearingSlots> slots{first.none(), second.none()};
      Bringing bringing{slots};
      while (!marchGrids<2>(scene, slots.data(), samples, ray, bringing)) {
        ray = KeptGridsRay::of(ray).progress(channelsOf(ray));
        ++waited;
      }
      EXPECT_TRUE(equal(finished<2>(scene, ray), finished<2>(scene, whole)));
    }
  EXPECT_GT(waited, 100);
}

// Levels of detail.

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

RenderOptions withLevels(const SparseVolume& volume) {
  RenderOptions o = optionsFor(volume, orthographic());
  o.lod = LevelOfDetail::kAuto;
  return o;
}

TEST(LevelOfDetail, WidePixelsShowTheCoarserVolume) {
  const SparseVolume volume = noise();
  VolumeLevels levels(volume);
  levels.prepare(3);
  for (const int level : {1, 2, 3}) {
    RenderOptions o = withLevels(volume), own = o;
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
  o.transfer = viridis();
  o.opacityLength = 40.0;
  return o;
}

/// A cube of 128^3 voxels that has one value in front of z = 64 and another behind.
SparseVolume halves(float front, float behind) {
  return cubeOf(16, 0.0f, [&](Coord at) { return at.z < 64 ? front : behind; });
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
  // The ramps of the coarsest level are up to 8 voxels long, of 127. By the number of samples,
  // which are closer in front, the mean would be above 0.7.
  EXPECT_NEAR(mean, 0.5, 0.05);
}

TEST(LevelOfDetail, CellsAndVolumesAgree) {
  const Field field = randomField({.count = 300, .extent = 120.0});
  const auto bricks = reachedBricks(field);
  const RevoxeliseOptions ofMeans{.bricks = bricks, .restrictToBricks = true};
  const SparseVolume volume = revoxelise(field, ofMeans);
  for (const auto mode :
       {RenderMode::kComposite, RenderMode::kAverage, RenderMode::kMaximum, RenderMode::kDepth}) {
    RenderOptions o = manyLevels();
    o.mode = mode;
    if (mode != RenderMode::kComposite) o.opacityLength = 5.0;
    const Image cells = renderField(field, o, ofMeans);
    EXPECT_GE(imagePsnr(renderVolume(volume, o), cells), 80.0) << int(mode);
    if (mode != RenderMode::kDepth) {  // whose values are no colors
      EXPECT_GE(imagePsnr(cells, renderField(field, o)), 30.0) << "sums, roughly: " << int(mode);
    }
    o.lod = LevelOfDetail::kOff;
    EXPECT_LT(imagePsnr(renderVolume(volume, o), cells), 60.0) << "levels must be at work";
  }
}

TEST(LevelOfDetail, PicturesAreCloserToThoseWithManyRays) {
  const SparseVolume volume = randomBricks(cornersOfCube(8), 7);
  RenderOptions o = withLevels(volume);
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
  EXPECT_GE(imagePsnr(expected, renderVolume(volume, o)), imagePsnr(expected, without) + 1.0);
}

TEST(LevelOfDetail, AThinClipBoxIsNotMissed) {
  const SparseVolume volume = noise();
  RenderOptions o = withLevels(volume), without = o;
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
