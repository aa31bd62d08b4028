// Plan: the voxels of a field are decoded when a ray asks for them. The pictures must have the same
// bits whatever was decoded before, in any order, and with memory for a part of a picture's bricks
// only; channels agree with the CPU's picture to within 1/255, and so do those of volumes. Bricks that
// the decoder makes on a GPU are compared with the definition in float64.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

// Fields.

constexpr Box kBox{{0, 0, 0}, {199, 199, 199}};
const RevoxeliseOptions kVoxels{.threshold = 0.05f};

Field manyBlobs() { return randomField({.count = 2000, .extent = 200.0}); }

RenderOptions options(double degrees = 0.0) {
  RenderOptions o = pictureOf(kBox, {160, 120}, 20.0);
  o.camera = turned(o.camera, degrees);
  return o;
}

class CellsOnGpu : public OnGpu {
 protected:
  [[nodiscard]] std::unique_ptr<Renderer> renderer(const Field& field,
                                                   const RendererLimits& limits = {}) const {
    return makeFieldRenderer(field, device_, limits, kVoxels);
  }
};

TEST_F(CellsOnGpu, DrawTheDecodedVolume) {
  const Field field = manyBlobs();
  const SparseVolume volume = revoxelise(field, kVoxels);
  for (const double degrees : {0.0, 70.0, 145.0}) {
    const Image expected = renderVolume(volume, options(degrees));
    expectClose(renderer(field)->draw(options(degrees)), expected);
  }
}

/// A box that cuts through bricks.
constexpr Box kCut{{11, 0, 0}, {150, 187, 131}};

/// A camera among the blobs whose pixels grow from a part of a voxel to 30 voxels.
RenderOptions manyLevels() {
  RenderOptions o = options();
  o.resolution = {40, 30};
  o.camera = {.eye = {100, 100, -10}, .center = {90, 110, 100}, .up = {0, 1, 0}, .fov = 120.0};
  return o;
}

/// Levels are sums where all values are on one side of the background, and means otherwise.
TEST_F(CellsOnGpu, DrawTheLevelsOfFieldsAndVolumes) {
  for (const bool onOneSide : {true, false}) {
    Field field = manyBlobs();
    if (onOneSide)
      for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
    const SparseVolume volume = revoxelise(field, kVoxels);
    const auto drawn = renderer(field), ofVolume = makeVolumeRenderer(volume, device_);
    RenderOptions flat = options();
    flat.camera.projection = Projection::kOrthographic;
    for (const double height : {1600.0, 3200.0, 6400.0, 12800.0, 25600.0}) {
      flat.camera.height = height;
      expectClose(drawn->draw(flat), renderField(field, flat, kVoxels));
      expectClose(ofVolume->draw(flat), renderVolume(volume, flat));
    }
    expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), kVoxels));
    expectClose(ofVolume->draw(manyLevels()), renderVolume(volume, manyLevels()));
  }
}

TEST_F(CellsOnGpu, DrawTheVoxelsOfMasksWithinABox) {
  const Field field = manyBlobs();
  const HalfMasks masked(field, kBox);
  const RevoxeliseOptions boxed{.threshold = 0.05f, .box = kCut};
  for (const RevoxeliseOptions& rule : {masked.within(kCut), boxed}) {
    const SparseVolume volume = revoxelise(field, rule);
    const auto drawn = makeFieldRenderer(field, device_, {}, rule);
    const Image image = drawn->draw(options(70.0));
    expectClose(image, renderVolume(volume, options(70.0)));
    expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule));
    EXPECT_EQ(drawn->draw(options(70.0)).rgba, image.rgba);
    EXPECT_NE(image.rgba, renderer(field)->draw(options(70.0)).rgba);
  }
}

TEST_F(CellsOnGpu, DrawVoxelsThatAreAlwaysActive) {
  const Field field = manyBlobs();
  std::vector<Coord> always;
  for (std::int32_t n = 0; n < 30; ++n) always.push_back(kBox.min + Coord{n, 10 + n % 7, 8});
  const RevoxeliseOptions rule{.threshold = 0.5f, .alwaysActive = always};
  const SparseVolume volume = revoxelise(field, rule);
  const auto drawn = makeFieldRenderer(field, device_, {}, rule);
  expectClose(drawn->draw(options(70.0)), renderVolume(volume, options(70.0)));
  expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule));
}

TEST_F(CellsOnGpu, DrawBricksOfWhichNoMaskHasAVoxel) {
  const Field field = manyBlobs();
  HalfMasks masked(field, kBox);
  masked.masks.assign(masked.bricks.size(), {});
  expectTransparent(makeFieldRenderer(field, device_, {}, masked.within(kCut))->draw(options()));
}

TEST_F(CellsOnGpu, AreShadedAsOnTheCpu) {
  const Field field = manyBlobs();
  const SparseVolume volume = revoxelise(field, kVoxels);
  RenderOptions shaded = options(30.0), levels = manyLevels();
  shaded.shading = levels.shading = Shading{};
  // A gradient near a flat spot turns with the rounding of its values.
  expectClose(renderer(field)->draw(shaded), renderVolume(volume, shaded), 200);
  expectClose(renderer(field)->draw(levels), renderField(field, levels, kVoxels), 200);
  expectClose(makeVolumeRenderer(volume, device_)->draw(shaded), renderVolume(volume, shaded), 200);
}

TEST_F(CellsOnGpu, AreMadeAndDrawnOnSeveralThreads) {
  const Field field = manyBlobs();
  const Image expected = renderer(field)->draw(options());
  std::atomic<int> equal = 0;
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n)
    threads.emplace_back([&] { equal += renderer(field)->draw(options()).rgba == expected.rgba; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(equal, 4);
}

TEST_F(CellsOnGpu, DrawManyEllipsoidsInOneBrickSlow) {
  const Field field = randomField({.count = 10'000'000, .extent = 8.0, .smallest = 0.3});
  RenderOptions o = pictureOf({{0, 0, 0}, {7, 7, 7}}, {24, 18}, 20.0);
  o.transfer = rescaled(o.transfer, {-1000.0f, 1000.0f});
  expectClose(makeFieldRenderer(field, device_, {}, {})->draw(o),
              renderVolume(revoxelise(field, {}), o), 100);
}

TEST_F(CellsOnGpu, HaveTheSameBitsOfAllLevels) {
  const Field field = manyBlobs();
  const auto drawn = renderer(field);
  const Image fresh = drawn->draw(manyLevels());
  (void)drawn->draw(options());
  EXPECT_EQ(drawn->draw(manyLevels()).rgba, fresh.rgba);
  drawn->forget();
  EXPECT_EQ(drawn->draw(manyLevels()).rgba, fresh.rgba);
}

TEST_F(CellsOnGpu, HaveTheSameBitsWhateverWasDecodedBefore) {
  const Field field = manyBlobs();
  const Image fresh = renderer(field)->draw(options(70.0));
  const auto other = renderer(field);
  for (const double degrees : {0.0, 35.0, 140.0}) (void)other->draw(options(degrees));
  EXPECT_EQ(other->draw(options(70.0)).rgba, fresh.rgba);
  EXPECT_EQ(other->draw(options(70.0)).rgba, fresh.rgba);
}

TEST_F(CellsOnGpu, HaveTheSameBitsInMemoryForAPartOfTheBricks) {
  const Field field = manyBlobs();
  const auto unlimited = renderer(field);
  const Image expected = unlimited->draw(options());
  const std::uint64_t needed = unlimited->stats().deviceBytes;
  for (const std::uint64_t less : {1u << 20, 4u << 20, 8u << 20}) {
    const auto limited = renderer(field, {.maxBytes = needed - less});
    EXPECT_EQ(limited->draw(options()).rgba, expected.rgba) << less;
    EXPECT_EQ(limited->draw(options()).rgba, expected.rgba) << less;
    EXPECT_LE(limited->stats().deviceBytes, needed - less);
  }
}

TEST_F(CellsOnGpu, TakeMemoryForWhatIsSeen) {
  const Field field = manyBlobs();
  const auto whole = renderer(field), part = renderer(field);
  RenderOptions clipped = options();
  clipped.clip = PlaceBox{{0, 0, 0}, {40, 40, 40}};
  (void)whole->draw(options());
  (void)part->draw(clipped);
  EXPECT_LT(part->stats().deviceBytes, whole->stats().deviceBytes);
}

TEST_F(CellsOnGpu, DrawNothingForAFieldOfNothing) {
  expectTransparent(renderer(Field{})->draw(options()));
}

TEST_F(CellsOnGpu, RefuseALimitThatIsTooSmall) {
  const Field field = manyBlobs();
  EXPECT_THROW((void)renderer(field, {.maxBytes = 1000})->draw(options()), DeviceError);
}

// Volumes.

SparseVolume blobs() {
  return revoxelise(randomField({.count = 60, .extent = 90.0, .origin = {-16, 8, 0}}),
                    {.threshold = 0.05f});
}

RenderOptions optionsOfVolume(const CameraWish& wish = {}) {
  return pictureOf({{-16, 8, 0}, {73, 97, 89}}, {131, 78}, 8.0, wish);
}

class BricksOnGpu : public OnGpu {
 protected:
  void expectTheCpusPicture(const RenderOptions& o, const RendererLimits& limits = {}) const {
    const SparseVolume volume = blobs();
    EXPECT_LE(largestDifference(makeVolumeRenderer(volume, device_, limits)->draw(o),
                                renderVolume(volume, o)),
              1.0 / 255.0);
  }
};

TEST_F(BricksOnGpu, AgreeFromEveryKindOfCamera) {
  expectTheCpusPicture(optionsOfVolume());
  expectTheCpusPicture(optionsOfVolume(orthographic()));
  expectTheCpusPicture(
      optionsOfVolume({.eye = Vec3{19.3, 51.7, 48.1}, .center = Vec3{0, 80, 3}, .fov = 80.0}));
  expectTheCpusPicture(optionsOfVolume(farAway({29, 53, 45}, 60.0)));
}

TEST_F(BricksOnGpu, AgreeForOtherStepsAndClipped) {
  for (const double step : {0.3, 4.0}) {
    RenderOptions o = optionsOfVolume();
    o.step = step;
    expectTheCpusPicture(o);
  }
  RenderOptions o = optionsOfVolume();
  o.classification = Classification::kPost;
  expectTheCpusPicture(o);
  o.classification = Classification::kPreIntegrated;
  o.clip = PlaceBox{{-5, 20, 10.5}, {40, 70, 60.5}};
  expectTheCpusPicture(o);
}

TEST_F(BricksOnGpu, DrawInBandsWhereMemoryIsShort) {
  const SparseVolume volume = blobs();
  const auto whole = makeVolumeRenderer(volume, device_);
  (void)whole->draw(optionsOfVolume());
  expectTheCpusPicture(optionsOfVolume(), {.maxBytes = whole->stats().deviceBytes - 100'000});
  EXPECT_THROW(
      (void)makeVolumeRenderer(volume, device_, {.maxBytes = 1000})->draw(optionsOfVolume()),
      DeviceError);
}

// Given bricks.

class DeviceBricks : public OnDevice {
 protected:
  [[nodiscard]] Stability measured(const Field& field) const {
    StabilityOptions options;
    options.evaluate = [&](const Field& f, std::span<const Coord> corners, std::span<float> out) {
      evaluateBricksOn(device_, f, corners, out);
    };
    options.arithmetic = arithmeticOf(device_);
    return measureStability(field, options);
  }
};

TEST_P(DeviceBricks, StayWithinTheBoundOfTheirArithmetic) {
  for (const RandomFieldOptions& shape : std::initializer_list<RandomFieldOptions>{
           {},
           {.smallest = 0.1, .aspect = 1000.0},
           {.kappa = -30.0f},
           {.kappa = 30.0f},
           {.count = 5000, .extent = 8.0, .smallest = 0.3},
           {.intensity = 1e-30},
           {.intensity = 1e30},
           {.origin = {10'000'000, -10'000'000, 10'000'000}}}) {
    const Stability s = measured(randomField(shape));
    EXPECT_GT(s.largest, 0.0) << "no rounding at all proves nothing";
    EXPECT_LT(s.shareOfBound, 1.0) << "kappa " << shape.kappa << ", aspect " << shape.aspect;
  }
}

TEST_P(DeviceBricks, HoldTheBackgroundWhereNothingReaches) {
  Field field = randomField({.count = 3});
  field.background = 0.25f;
  const std::vector<Coord> corners{{-800, 0, 0}, {0, 0, 0}, {800, 0, 0}};
  std::vector<float> values(corners.size() * kBrickVoxels);
  evaluateBricksOn(device_, field, corners, values);
  const std::span all(values);
  EXPECT_THAT(all.first(kBrickVoxels), testing::Each(0.25f));
  EXPECT_THAT(all.last(kBrickVoxels), testing::Each(0.25f));
}

TEST_P(DeviceBricks, AreTheSameInAnyCompany) {
  const Field field = randomField({.count = 2000, .extent = 100.0});
  const auto corners = reachedBricks(field);
  ASSERT_GT(corners.size(), 600u) << "the bricks of several batches";
  std::vector<float> all(corners.size() * kBrickVoxels), one(kBrickVoxels);
  evaluateBricksOn(device_, field, corners, all);
  const std::size_t chosen = corners.size() / 2;
  evaluateBricksOn(device_, field, std::span(corners).subspan(chosen, 1), one);
  EXPECT_THAT(
      one, testing::ElementsAreArray(std::span(all).subspan(chosen * kBrickVoxels, kBrickVoxels)));
}

ESVR_ON_DEVICES(DeviceBricks);

}  // namespace
}  // namespace esvr::test
