// Plan: the voxels of a field are decoded when a ray asks for them. The pictures must have the same
// bits whatever was decoded before, in any order, and with memory for a part of a picture's bricks
// only; channels agree with the CPU's picture of the decoded volume to within 1/255. Memory follows
// what is seen. Restricted bricks and fields of nothing are drawn too.
//
// A volume's picture agrees with renderVolume on the CPU to within 1/255 of a channel, for every
// kind of camera, step sizes, a clip box and bands. Tiles that no brick covers stay empty.
//
// Given bricks that the decoder makes on a GPU are compared with the definition in float64, for
// fields of several kernels, shapes and origins. Bricks that no ellipsoid reaches hold the
// background. On the CPU, the bricks are those of evaluateBricks().
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "support/on_device.h"

namespace esvr::test {
namespace {

// Fields.

constexpr Box kBox{{0, 0, 0}, {199, 199, 199}};
const RevoxeliseOptions kVoxels{.threshold = 0.05f};

Field manyBlobs() { return randomField({.count = 2000, .extent = 200.0}); }

RenderOptions options(double degrees = 0.0) {
  RenderOptions o;
  o.resolution = {160, 120};
  o.camera = turned(fitCamera(kBox, {}, o.resolution), degrees);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 20.0;
  return o;
}

/// Channels agree to within 1/255, but for one in `many`: rounding decides about the few voxels
/// whose value is at the threshold.
void expectClose(const Image& image, const Image& expected, std::size_t many) {
  std::size_t different = 0, lit = 0;
  for (std::size_t i = 0; i < image.rgba.size(); ++i) {
    different += std::abs(image.rgba[i] - expected.rgba[i]) > 1.0f / 255.0f;
    lit += expected.rgba[i] > 0.1f;
  }
  EXPECT_LE(different, image.rgba.size() / many);
  EXPECT_GT(lit, 0u) << "an empty picture proves nothing";
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
    expectClose(renderer(field)->draw(options(degrees)), expected, 1000);
  }
}

/// Bricks with masks of which half of the voxels are active, and a box that cuts through bricks.
struct MasksInABox {
  Box box{{11, 0, 0}, {150, 187, 131}};
  std::vector<Coord> bricks;
  std::vector<BrickMask> masks;

  explicit MasksInABox(const Field& field) : bricks(reachedBricks(field, {{0, 0, 0}, kBox.max})) {
    masks.resize(bricks.size());
    for (std::size_t b = 0; b < masks.size(); ++b)
      for (int v = 0; v < kBrickVoxels; ++v)
        if ((v + int(b)) % 16 < 8) masks[b].set(v);
  }
  [[nodiscard]] RevoxeliseOptions rule() const {
    return {.bricks = bricks, .restrictToBricks = true, .masks = masks, .box = box};
  }
};

/// A camera among the blobs whose pixels grow from a part of a voxel to 30 voxels.
RenderOptions manyLevels() {
  RenderOptions o = options();
  o.resolution = {40, 30};
  o.camera = {.eye = {100, 100, -10}, .center = {90, 110, 100}, .up = {0, 1, 0}, .fov = 120.0};
  return o;
}

TEST_F(CellsOnGpu, DrawTheLevelsOfFieldsAndVolumes) {
  const Field field = manyBlobs();
  const SparseVolume volume = revoxelise(field, kVoxels);
  const auto drawn = renderer(field), ofVolume = makeVolumeRenderer(volume, device_);
  RenderOptions orthographic = options();
  orthographic.camera.projection = Projection::kOrthographic;
  for (const double height : {1600.0, 3200.0, 6400.0, 12800.0, 25600.0}) {
    orthographic.camera.height = height;
    expectClose(drawn->draw(orthographic), renderField(field, orthographic, kVoxels), 1000);
    expectClose(ofVolume->draw(orthographic), renderVolume(volume, orthographic), 1000);
  }
  expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), kVoxels), 1000);
  expectClose(ofVolume->draw(manyLevels()), renderVolume(volume, manyLevels()), 1000);
}

TEST_F(CellsOnGpu, DrawTheVoxelsOfMasksWithinABox) {
  const Field field = manyBlobs();
  const MasksInABox masked(field);
  const RevoxeliseOptions boxed{.threshold = 0.05f, .box = masked.box};
  for (const RevoxeliseOptions& rule : {masked.rule(), boxed}) {
    const SparseVolume volume = revoxelise(field, rule);
    const auto drawn = makeFieldRenderer(field, device_, {}, rule);
    const Image image = drawn->draw(options(70.0));
    expectClose(image, renderVolume(volume, options(70.0)), 1000);
    expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule), 1000);
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
  expectClose(drawn->draw(options(70.0)), renderVolume(volume, options(70.0)), 1000);
  expectClose(drawn->draw(manyLevels()), renderField(field, manyLevels(), rule), 1000);
}

TEST_F(CellsOnGpu, DrawBricksOfWhichNoMaskHasAVoxel) {
  const Field field = manyBlobs();
  MasksInABox masked(field);
  masked.masks.assign(masked.bricks.size(), {});
  const Image image = makeFieldRenderer(field, device_, {}, masked.rule())->draw(options());
  EXPECT_EQ(std::count(image.rgba.begin(), image.rgba.end(), 0.0f),
            std::ptrdiff_t(image.rgba.size()));
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
  RenderOptions o = options();
  o.resolution = {24, 18};
  o.camera = fitCamera({{0, 0, 0}, {7, 7, 7}}, {}, o.resolution);
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
  const Image image = renderer(Field{})->draw(options());
  EXPECT_EQ(std::count(image.rgba.begin(), image.rgba.end(), 0.0f),
            std::ptrdiff_t(image.rgba.size()));
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
  RenderOptions o;
  o.resolution = {131, 78};
  o.camera = fitCamera({{-16, 8, 0}, {73, 97, 89}}, wish, o.resolution);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 8.0;
  return o;
}

class BricksOnGpu : public OnGpu {
 protected:
  void expectTheCpusPicture(const RenderOptions& o, const RendererLimits& limits = {}) const {
    const SparseVolume volume = blobs();
    const Image expected = renderVolume(volume, o);
    const Image image = makeVolumeRenderer(volume, device_, limits)->draw(o);
    ASSERT_EQ(image.rgba.size(), expected.rgba.size());
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      ASSERT_NEAR(image.rgba[i], expected.rgba[i], 1.0 / 255.0);
  }
};

TEST_F(BricksOnGpu, AgreeFromEveryKindOfCamera) {
  expectTheCpusPicture(optionsOfVolume());
  expectTheCpusPicture(optionsOfVolume({.projection = Projection::kOrthographic}));
  expectTheCpusPicture(
      optionsOfVolume({.eye = Vec3{19.3, 51.7, 48.1}, .center = Vec3{0, 80, 3}, .fov = 80.0}));
  CameraWish far{.eye = Vec3{1e6, 2e6, 3.3e6}, .center = Vec3{29, 53, 45}};
  far.fov = 2.0 * std::atan(60.0 / 4e6) * 180.0 / 3.14159265358979;
  expectTheCpusPicture(optionsOfVolume(far));
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
