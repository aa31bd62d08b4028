// Plan: a CUDA device draws the same pictures as the CPU, with samples between voxels and from the
// sum, for cameras, kernels, shapes, transfer functions, steps, sizes, parts of the depth and
// bands. Channels agree to within 1/255: the hardware's exponential and division are precise to
// about 1e-6 of an intensity, and a ray may end one sample earlier or later, which changes a
// channel by 1/4096. Lists that are longer than the first buffers or than a block, and further
// runs, must not change a bit. Without a GPU, the call must say why it fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

constexpr double kAsked = 1.0 / 255.0;

/// Rounding decides about a voxel if m is within about 1e-7 of the end of a support. This is hardly
/// one voxel of the 64,000 in these scenes. With the default camera, the samples of a voxel, which
/// lie up to one voxel to each side of it, cover at most 5 x 5 pixels of four channels.
constexpr std::size_t kVoxelsOnAnEnd = 2;
constexpr std::size_t kChannelsOnAnEnd = kVoxelsOnAnEnd * 25 * 4;

std::size_t channelsThatDiffer(const Image& a, const Image& b) {
  if (a.rgba.size() != b.rgba.size()) return std::max(a.rgba.size(), b.rgba.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    count += std::abs(double(a.rgba[i]) - double(b.rgba[i])) > kAsked;
  return count;
}

TEST(FieldRenderer, SaysWhichDeviceIsNotThere) {
  const Field field = randomField({});
  EXPECT_THROW((void)makeFieldRenderer(field, {DeviceKind::kCuda, 12345}), DeviceError);
}

class FieldOnGpu : public OnGpu, public testing::WithParamInterface<Between> {
 protected:
  [[nodiscard]] RenderOptions optionsFor(const CameraWish& wish = {},
                                         Resolution resolution = {130, 77}) const {
    RenderOptions o = pictureOf(kFieldBox, resolution, 8.0, wish);
    o.between = GetParam();
    // Rounding decides whether a voxel at the end of a support is exactly the background. With this
    // transfer function its samples are transparent in both cases; another test uses the linear
    // curve.
    if (o.between == Between::kVoxels) o.transfer.opacity = {{-1.0, 1.0}, {0.0, 0.0}, {1.0, 1.0}};
    return o;
  }
  [[nodiscard]] Image drawn(const Field& field, const RenderOptions& o,
                            const RendererLimits& limits = {},
                            const RevoxeliseOptions& voxels = {}) const {
    return makeFieldRenderer(field, device_, limits, voxels)->draw(o);
  }
  void expectTheCpusPicture(const Field& field, const RenderOptions& o,
                            const RendererLimits& limits = {},
                            const RevoxeliseOptions& voxels = {}) const {
    const Image expected = renderField(field, o, voxels);
    expectAnyLight(expected);
    EXPECT_LE(largestDifference(drawn(field, o, limits, voxels), expected), kAsked);
  }
};

TEST_P(FieldOnGpu, AgreesFromEveryKindOfCamera) {
  for (const CameraWish& wish : {CameraWish{}, orthographic(), inside()})
    expectTheCpusPicture(randomField({.count = 300}), optionsFor(wish));
  CameraWish flat = inside();
  flat.projection = Projection::kOrthographic, flat.fov.reset();
  expectTheCpusPicture(randomField({}), optionsFor(flat));
}

TEST_P(FieldOnGpu, AgreesFromFarAway) {
  expectTheCpusPicture(randomField({.count = 300}), optionsFor(farAway()));
}

TEST_P(FieldOnGpu, AgreesForNeedlesPancakesAndEachKernel) {
  expectTheCpusPicture(randomField({.count = 100, .smallest = 0.1, .aspect = 200.0}), optionsFor());
  for (const float kappa : {-30.0f, -3.0f, 0.0f, 12.0f, 50.0f})
    expectTheCpusPicture(randomField({.count = 100, .kappa = kappa}), optionsFor());
  expectTheCpusPicture(ownKappas(), optionsFor());
}

TEST_P(FieldOnGpu, AgreesForOneEllipsoidThatCoversEverything) {
  expectTheCpusPicture(oneEllipsoid(300.0), optionsFor());
}

TEST_P(FieldOnGpu, AgreesWithABackgroundAndSeveralChunks) {
  expectTheCpusPicture(twoChunks(), optionsFor());
}

TEST_P(FieldOnGpu, AgreesForOtherStepsSizesAndOpacities) {
  const Field field = randomField({.count = 200});
  for (const double step : {0.1, 0.7, 5.0}) {
    RenderOptions o = optionsFor();
    o.step = step;
    expectTheCpusPicture(field, o);
  }
  expectTheCpusPicture(field, optionsFor({}, {1, 1}));
  expectTheCpusPicture(field, optionsFor({}, {1031, 3}));
  for (const double opacity : {0.0, 1.0}) {
    RenderOptions o = optionsFor();
    o.transfer.opacity = {{0.0, opacity}};
    EXPECT_LE(largestDifference(drawn(field, o), renderField(field, o)), kAsked) << opacity;
  }
}

TEST_P(FieldOnGpu, AgreesWhereTheBackgroundsValueIsOpaque) {
  const Field field = randomField({.count = 300});
  RenderOptions o = optionsFor();
  o.transfer = rescaled({o.transfer.colors, builtInOpacity("linear")}, {-1.0f, 1.0f});
  const Image expected = renderField(field, o);
  EXPECT_LE(channelsThatDiffer(drawn(field, o), expected), kChannelsOnAnEnd);
}

TEST_P(FieldOnGpu, DrawsThePartsOfTheDepthAsOne) {
  const Field field = randomField({.count = 2000, .extent = 200.0, .smallest = 3.0});
  RenderOptions o = optionsFor();
  o.camera = fitCamera({{0, 0, 0}, {199, 199, 199}}, {}, o.resolution);
  for (const double opacityLength : {0.2, 30.0}) {
    o.opacityLength = opacityLength;
    for (const int parts : {0, 1, 2, 3, 16}) expectTheCpusPicture(field, o, {.depthParts = parts});
  }
}

TEST_P(FieldOnGpu, AgreesWithPostClassificationAndOnSteepSurfaces) {
  const Field field = randomField({.count = 400});
  RenderOptions o = optionsFor();
  o.classification = Classification::kPost;
  for (const int parts : {1, 3}) expectTheCpusPicture(field, o, {.depthParts = parts});
  o.classification = Classification::kPreIntegrated;
  o.transfer.opacity = {{-1.0, 0.0}, {0.3, 0.0}, {0.4, 1.0}, {1.0, 1.0}};
  for (const int parts : {1, 3}) expectTheCpusPicture(field, o, {.depthParts = parts});
}

TEST_P(FieldOnGpu, AgreesInEachModeAndClipped) {
  const Field field = randomField({.count = 400});
  for (const auto mode : {RenderMode::kMaximum, RenderMode::kAverage})
    for (const int parts : {1, 2}) {
      RenderOptions o = optionsFor();
      o.mode = mode;
      const Image expected = renderField(field, o);
      const Image image = drawn(field, o, {.depthParts = parts});
      // A sample at the end of a support has the value 0, and may count on one device only.
      EXPECT_LE(channelsThatDiffer(image, expected), kChannelsOnAnEnd) << int(mode) << parts;
    }
  RenderOptions o = optionsFor();
  o.clip = PlaceBox{{5.3, 0.1, -100}, {22.2, 31.7, 100}};
  expectTheCpusPicture(field, o);
}

TEST_P(FieldOnGpu, DrawsListsLongerThanABlock) {
  const Field field = randomField({.count = 3000, .extent = 4.0});
  RenderOptions o = optionsFor({}, {40, 30});
  o.transfer = rescaled(o.transfer, {-30.0f, 30.0f});
  expectTheCpusPicture(field, o);
}

TEST_P(FieldOnGpu, DrawsInBandsWhereMemoryIsShort) {
  const Field field = randomField({.count = 300});
  const RenderOptions o = optionsFor({}, {500, 400});
  const auto whole = makeFieldRenderer(field, device_);
  const Image expected = whole->draw(o);
  const std::uint64_t bound = whole->stats().deviceBytes / 3;
  const auto banded = makeFieldRenderer(field, device_, {.depthParts = 1, .maxBytes = bound});
  EXPECT_LE(largestDifference(banded->draw(o), expected), kAsked);
  EXPECT_LE(banded->stats().deviceBytes, bound);
  EXPECT_THROW((void)makeFieldRenderer(field, device_, {.maxBytes = 1000})->draw(o), DeviceError);
}

TEST_P(FieldOnGpu, DrawsTheWidestPicture) {
  expectTheCpusPicture(randomField({.count = 300}), optionsFor({}, {16384, 9}));
}

// A table of the blocks between puffs over 60,000 voxels would take gigabytes.
TEST_P(FieldOnGpu, DrawsEllipsoidsThatLieFarApart) {
  const Field field = puffsFarApart();
  RenderOptions o = optionsFor();
  lookAt(field, 17, o.camera);
  const auto renderer = makeFieldRenderer(field, device_);
  EXPECT_LE(largestDifference(renderer->draw(o), makeFieldRenderer(field, Device{})->draw(o)),
            kAsked);
  o.shading = Shading{};
  EXPECT_THROW((void)renderer->draw(o), UsageError);
}

TEST_P(FieldOnGpu, GivesTheSameBitsInEveryRun) {
  const Field field = randomField({.count = 5000, .extent = 40.0});
  const auto renderer = makeFieldRenderer(field, device_, {.depthParts = 3});
  const Image first = renderer->draw(optionsFor());
  (void)renderer->draw(optionsFor(orthographic()));
  EXPECT_EQ(renderer->draw(optionsFor()).rgba, first.rgba);
  EXPECT_EQ(drawn(field, optionsFor(), {.depthParts = 3}).rgba, first.rgba);
}

TEST_P(FieldOnGpu, NothingToSeeIsTransparent) {
  expectTransparent(drawn(Field{}, optionsFor()));
  expectTransparent(drawn(randomField({}), optionsFor(away())));
}

TEST_P(FieldOnGpu, CountsItsWork) {
  const Field field = randomField({.count = 50});
  const auto renderer = makeFieldRenderer(field, device_);
  renderer->drawOnDevice(optionsFor());
  const FrameStats stats = renderer->stats();
  if (GetParam() == Between::kSum) {
    EXPECT_GE(stats.listEntries, 50u);
    EXPECT_GT(stats.occupancy, 0.0);
    EXPECT_LE(stats.occupancy, 1.0);
  }
  EXPECT_GT(stats.drawMs, 0.0);
  EXPECT_GT(stats.deviceBytes, 130u * 77u * 16u);
}

TEST_P(FieldOnGpu, AgreesWhereAPixelHoldsManyVoxelsAndWhereItHoldsAPart) {
  const Field field = randomField({.count = 300});
  for (const double times : {0.05, 0.5, 3.0, 20.0, 200.0}) {
    RenderOptions o = optionsFor(orthographic(), {30, 21});
    o.camera.height *= times;
    if (times < 0.1) o.opacityLength = 0.5;
    const Image expected = renderField(field, o);
    EXPECT_LE(largestDifference(drawn(field, o), expected), kAsked) << times;
  }
}

TEST_P(FieldOnGpu, AgreesFromEveryDirectionAndForAnyFieldOfView) {
  const Field field = randomField({.count = 200});
  for (int turn = 0; turn < 12; ++turn) {
    RenderOptions o = optionsFor({}, {64, 48});
    o.camera = turned(o.camera, 30.0 * turn + 1.0);
    expectTheCpusPicture(field, o);
  }
  for (const Vec3 up : {Vec3{1, 0, 0}, Vec3{0, 0, 1}})
    expectTheCpusPicture(field, optionsFor({.eye = Vec3{20, 130, 21}, .up = up}, {64, 48}));
  expectTheCpusPicture(
      field,
      optionsFor({.eye = Vec3{19, 21, 18}, .center = Vec3{30, 22, 20}, .fov = 170.0}, {64, 48}));
}

TEST_P(FieldOnGpu, AgreesByTheRuleOfTheVoxels) {
  Field field = randomField({.count = 300});
  field.background = 0.125f;
  expectTheCpusPicture(field, optionsFor(), {},
                       {.threshold = 0.1f, .range = ValueRange{-0.25f, 0.5f}});
  field.background = 0.0f;
  expectTheCpusPicture(field, optionsFor(), {},
                       {.tone = {0.1f}, .threshold = 0.1f, .range = ValueRange{-0.5f, 1.0f}});
  field.background = 0.75f;
  expectTheCpusPicture(field, optionsFor(), {}, {.threshold = 0.1f, .narrowBand = true});
}

INSTANTIATE_TEST_SUITE_P(Between, FieldOnGpu, testing::Values(Between::kVoxels, Between::kSum),
                         [](const auto& of) {
                           return of.param == Between::kVoxels ? "Voxels" : "Sum";
                         });

}  // namespace
}  // namespace esvr::test
