// Plan: pictures of random fields with Between::kSum (window_tile_test.cpp has the other case) are
// compared with the float64 reference (reference_picture.h), for every kind of camera. These
// differences are expected: float32 sums (1e-6 of the intensities), the table of the transfer
// function where the color map bends (1e-5 of a color), samples at the end of a support, which are
// 0 up to rounding, and the light behind minTransmittance, at most 1/4096 of a channel, which gives
// 72 dB if every pixel loses it. The tests require 70 dB; a sample that is missed or taken twice
// costs more.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "esvr/error.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/vector.h"
#include "support/on_threads.h"

namespace esvr::test {
namespace {

constexpr double kAsked = 70.0;
constexpr Box kBox{{0, 0, 0}, {39, 39, 39}};

TransferFunction viridis(ValueRange range = {-1.0f, 1.0f}) {
  return rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, range);
}

RenderOptions optionsFor(const CameraWish& wish = {}, Resolution resolution = {50, 37}) {
  RenderOptions o;
  o.resolution = resolution;
  o.camera = fitCamera(kBox, wish, resolution);
  o.transfer = viridis();
  o.opacityLength = 8.0;
  o.between = Between::kSum;
  return o;
}

double agreement(const Field& field, const RenderOptions& o,
                 const std::optional<ValueRange>& range = std::nullopt) {
  const double farthest = length(difference(o.camera.eye, o.camera.center)) + 100.0;
  const auto clamped = [&, sum = sumOfEllipsoids(field)](const Vec3& place) {
    return range ? std::clamp(sum(place), double(range->min), double(range->max)) : sum(place);
  };
  const Image expected = referencePicture({clamped, field.background, farthest}, o);
  const Image drawn = renderField(field, o, {.range = range});
  double light = 0.0;
  for (const float v : drawn.rgba) light += v;
  EXPECT_GT(light, 0.0) << "an empty picture proves nothing";
  return imagePsnr(expected, drawn);
}

TEST(RenderField, AgreesWithTheReferenceInPerspective) {
  EXPECT_GE(agreement(randomField({}), optionsFor()), kAsked);
}

TEST(RenderField, AgreesWithTheReferenceInOrthographicProjection) {
  EXPECT_GE(agreement(randomField({}), optionsFor({.projection = Projection::kOrthographic})),
            kAsked);
}

TEST(RenderField, AgreesWithACameraInsideTheVolume) {
  const CameraWish inside{.eye = Vec3{19.3, 21.7, 18.1}, .center = Vec3{0, 40, 3}, .fov = 80.0};
  EXPECT_GE(agreement(randomField({}), optionsFor(inside)), kAsked);
  CameraWish flat = inside;
  flat.projection = Projection::kOrthographic;
  EXPECT_GE(agreement(randomField({}), optionsFor(flat)), kAsked);
}

TEST(RenderField, SlowClampsSumsToTheRangeOfTheVoxels) {
  Field field = randomField({.count = 300});
  field.background = 0.125f;
  EXPECT_GE(agreement(field, optionsFor(), ValueRange{-0.25f, 0.5f}), kAsked);
}

TEST(RenderField, AgreesForNeedlesAndPancakes) {
  EXPECT_GE(agreement(randomField({.smallest = 0.1, .aspect = 200.0}), optionsFor()), kAsked);
}

TEST(RenderField, AgreesForANeedleAlongTheViewRay) {
  Field field = randomField({.count = 1});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (int a = 0; a < 3; ++a) e.center[a][0] = 20.0f;
  for (int a = 0; a < 4; ++a) e.rotation[a][0] = a == 0 ? 1.0f : 0.0f;
  e.logScale[0][0] = e.logScale[1][0] = std::log(0.4f), e.logScale[2][0] = std::log(15.0f);
  e.intensity[0] = 1.0f;
  RenderOptions o = optionsFor({.eye = Vec3{20, 20, 120}, .center = Vec3{20, 20, 20}}, {51, 51});
  o.transfer = viridis({0.0f, 1.0f});
  EXPECT_GE(agreement(field, o), kAsked);
}

TEST(RenderField, AgreesForOneEllipsoidThatCoversEverything) {
  Field field = randomField({.count = 1, .smallest = 300.0});
  field.chunks[0].ellipsoids.intensity[0] = 0.3f;
  EXPECT_GE(agreement(field, optionsFor()), kAsked);
}

TEST(RenderField, AgreesForEachKernel) {
  for (const float kappa : {-3.0f, 0.0f, 12.0f})
    EXPECT_GE(agreement(randomField({.kappa = kappa}), optionsFor({}, {25, 18})), kAsked) << kappa;
  Field field = randomField({.count = 15, .kappa = 5.0f});
  field.chunks[0].ellipsoids.kappa.assign(15, 1.0f);
  field.chunks[0].ellipsoids.kappa[3] = 20.0f;
  EXPECT_GE(agreement(field, optionsFor()), kAsked) << "a kappa of its own each";
}

TEST(RenderField, AgreesForOtherSteps) {
  for (const double step : {0.3, 2.5}) {
    RenderOptions o = optionsFor({}, {25, 18});
    o.step = step;
    EXPECT_GE(agreement(randomField({}), o), kAsked) << step;
  }
}

TEST(RenderField, AgreesWithABackgroundAndSeveralChunks) {
  Field field = randomField({.count = 20});
  field.background = 0.25f;
  field.chunks.push_back(randomField({.count = 20, .extent = 20.0, .seed = 9}).chunks[0]);
  field.chunks[1].origin = {16, -8, 8};
  EXPECT_GE(agreement(field, optionsFor()), kAsked);
}

TEST(RenderField, FarCamerasLoseNothing) {
  // From 1e5 times the volume's size, 4e6 voxels, the picture shows the same ellipsoids, with about
  // 1e-9 voxel of rounding in float64.
  const Vec3 away{1e6, 2e6, 3.3e6};
  CameraWish wish{.eye = sum(away, {20, 20, 20}), .center = Vec3{20, 20, 20}};
  wish.fov = 2.0 * std::atan(30.0 / length(away)) * 180.0 / 3.14159265358979;
  RenderOptions o = optionsFor(wish, {20, 20});
  const Vec3 forward = unit(difference(o.camera.center, o.camera.eye));
  // The reference takes samples from 0 on. A plane that is nearer by a whole number of steps has
  // the same samples, if the rays hardly diverge: here by at most 70 / 4e6 over 100 voxels.
  RenderOptions near = o;
  near.camera.projection = Projection::kOrthographic;
  near.camera.height = 2.0 * 30.0;
  const double steps = std::floor(length(difference(o.camera.center, o.camera.eye)) - 100.0);
  near.camera.eye = sum(o.camera.eye, scaled(forward, steps));
  EXPECT_GE(imagePsnr(renderField(randomField({}), o), renderField(randomField({}), near)), 50.0);
}

TEST(RenderField, IsTheSameForAnyNumberOfThreads) {
  const Field field = randomField({.count = 300});
  const RenderOptions o = optionsFor({}, {130, 70});
  const auto draw = [&] { return renderField(field, o).rgba; };
  const auto one = onThreads(1, draw);
  EXPECT_EQ(one, onThreads(2, draw));
  EXPECT_EQ(one, onThreads(5, draw));
}

TEST(RenderField, TheEndOfARayCostsLittle) {
  RenderOptions early = optionsFor(), never = optionsFor();
  early.opacityLength = never.opacityLength = 0.5;
  never.minTransmittance = 0.0;
  const Field field = randomField({.count = 100});
  EXPECT_LE(largestDifference(renderField(field, early), renderField(field, never)),
            early.minTransmittance * 1.01);
}

TEST(RenderField, WhatIsNotSeenIsTransparent) {
  const Field field = randomField({});
  const Image behind =
      renderField(field, optionsFor({.eye = Vec3{20, 20, 200}, .center = Vec3{20, 20, 300}}));
  for (const float v : behind.rgba) ASSERT_EQ(v, 0.0f);
  const Image none = renderField(Field{}, optionsFor());
  for (const float v : none.rgba) ASSERT_EQ(v, 0.0f);
}

TEST(RenderField, APixelAloneIsAPicture) {
  EXPECT_GE(agreement(randomField({.count = 200}), optionsFor({}, {1, 1})), kAsked);
}

TEST(RenderField, FullOpacityShowsTheFirstSampleAndNoneShowsNothing) {
  RenderOptions o = optionsFor();
  o.transfer.opacity = {{0.0, 1.0}};
  const Image opaque = renderField(randomField({}), o);
  for (std::size_t i = 3; i < opaque.rgba.size(); i += 4)
    ASSERT_TRUE(opaque.rgba[i] == 0.0f || opaque.rgba[i] == 1.0f);
  o.transfer.opacity = {{0.0, 0.0}};
  for (const float v : renderField(randomField({}), o).rgba) ASSERT_EQ(v, 0.0f);
}

TEST(RenderField, ATransferFunctionBesideTheDataIsTheColorAtItsEnd) {
  Field field = randomField({.count = 50});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  RenderOptions o = optionsFor();
  o.transfer.colors.points = {{100.0, {0.5, 0.25, 0.0}}, {200.0, {0.0, 0.0, 1.0}}};
  o.transfer.opacity = {{100.0, 1.0}, {200.0, 0.0}};
  const Image image = renderField(field, o);
  double lit = 0.0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    lit += image.rgba[i + 3];
    ASSERT_NEAR(image.rgba[i], 0.5 * image.rgba[i + 3], 1e-6);
    ASSERT_NEAR(image.rgba[i + 1], 0.25 * image.rgba[i + 3], 1e-6);
  }
  EXPECT_GT(lit, 0.0);
}

TEST(RenderField, OptionsThatMakeNoSenseAreRefused) {
  const auto refused = [](auto&& spoil) {
    RenderOptions o = optionsFor();
    spoil(o);
    EXPECT_THROW((void)renderField(Field{}, o), UsageError);
    EXPECT_THROW((void)renderVolume(SparseVolume{}, o), UsageError);
  };
  refused([](auto& o) { o.step = 0.0; });
  refused([](auto& o) { o.step = -1.0; });
  refused([](auto& o) { o.step = std::numeric_limits<double>::quiet_NaN(); });
  refused([](auto& o) { o.opacityLength = 0.0; });
  refused([](auto& o) { o.minTransmittance = 1.0; });
  refused([](auto& o) { o.resolution.width = 0; });
  refused([](auto& o) { o.transfer.opacity.clear(); });
  refused([](auto& o) { o.transfer.opacity[0].x = std::nan(""); });
  refused([](auto& o) { std::swap(o.transfer.opacity.front(), o.transfer.opacity.back()); });
  refused([](auto& o) { o.camera.eye = o.camera.center; });
}

TEST(RenderField, StopsWhereAsked) {
  CancelToken cancel;
  cancel.cancel();
  RenderOptions o = optionsFor();
  o.cancel = &cancel;
  EXPECT_THROW((void)renderField(randomField({}), o), Cancelled);
}

// A file may contain such a support. Without the limits, the rays and the list of bricks would have
// no end.
TEST(RenderField, SupportsOfAnySizeAreRefused) {
  for (const float logScale : {18.0f, 32.0f}) {
    Field field = randomField({.count = 3});
    for (auto& scale : field.chunks[0].ellipsoids.logScale) scale[1] = logScale;
    RenderOptions o = optionsFor({}, {4, 4});
    o.between = Between::kSum;
    EXPECT_THROW((void)renderField(field, o), UsageError) << logScale;
    o.between = Between::kVoxels;
    EXPECT_THROW((void)renderField(field, o), MemoryExceeded) << logScale;
  }
}

}  // namespace
}  // namespace esvr::test
