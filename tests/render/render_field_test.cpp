// Plan: pictures of random fields with Between::kSum are compared with the float64 reference
// (reference_picture.h), for every kind of camera. These differences are expected: float32 sums
// (1e-6 of the intensities), the table of the transfer function where the color map bends (1e-5 of
// a color), samples at the end of a support, which are 0 up to rounding, and the light behind
// minTransmittance, at most 1/4096 of a channel, which gives 72 dB if every pixel loses it. The
// tests require 70 dB; a sample that is missed or taken twice costs more.
//
// The bounds of an ellipsoid in the picture are compared with the pixels whose rays meet the
// support, which are found in float64 from the rays. No such pixel may lie outside. For round
// ellipsoids of ten pixels the bounds are exact to a pixel, because the outline moves inward by
// only 0.5^2 / (2 * 10) pixels between two rows.
//
// The largest value, the mean, the depth of half the light along each ray, and a clip box agree
// with the same quantities computed in float64 from every sample, for sums and for voxels. A depth
// may differ by one sample where the light is almost half, so a few pixels may differ there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/render.h"
#include "field/line_form.h"
#include "field/random_field.h"
#include "render/ellipsoid_view.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "support/machine.h"

namespace esvr::test {
namespace {

constexpr double kAskedOfSums = 70.0;

// Pictures.

RenderOptions sumOptions(const CameraWish& wish = {}, Resolution resolution = {50, 37}) {
  RenderOptions o = pictureOf(kFieldBox, resolution, 8.0, wish);
  o.between = Between::kSum;
  return o;
}

double sumAgreement(const Field& field, const RenderOptions& o,
                    const std::optional<ValueRange>& range = std::nullopt, ToneCurve tone = {}) {
  const double farthest = length(difference(o.camera.eye, o.camera.center)) + 100.0;
  const auto clamped = [&, sum = sumOfEllipsoids(field)](const Vec3& place) {
    const double s = tone.scale;
    const double value = tone.isOn() ? s * std::sinh(sum(place) / s) : sum(place);
    return range ? std::clamp(value, double(range->min), double(range->max)) : value;
  };
  const Image expected = referencePicture({clamped, field.background, farthest, false}, o);
  const Image drawn = renderField(field, o, {.tone = tone, .range = range});
  expectAnyLight(drawn);
  return imagePsnr(expected, drawn);
}

TEST(RenderField, AgreesWithTheReferenceFromEveryKindOfCamera) {
  CameraWish flat = inside();
  flat.projection = Projection::kOrthographic;
  for (const CameraWish& wish : {CameraWish{}, orthographic(), inside(), flat})
    EXPECT_GE(sumAgreement(randomField({}), sumOptions(wish)), kAskedOfSums)
        << int(wish.projection) << (wish.eye ? ", inside" : "");
}

TEST(RenderField, SlowClampsSumsToTheRangeOfTheVoxels) {
  Field field = randomField({.count = 300});
  field.background = 0.125f;
  EXPECT_GE(sumAgreement(field, sumOptions(), ValueRange{-0.25f, 0.5f}), kAskedOfSums);
}

TEST(RenderField, SlowDrawsTheValuesOfTones) {
  const Field field = randomField({.count = 300});
  EXPECT_GE(sumAgreement(field, sumOptions(), ValueRange{-1.0f, 1.0f}, {0.1f}), kAskedOfSums);
}

TEST(RenderField, AgreesForNeedlesAndPancakes) {
  EXPECT_GE(sumAgreement(randomField({.smallest = 0.1, .aspect = 200.0}), sumOptions()),
            kAskedOfSums);
}

TEST(RenderField, AgreesForANeedleAlongTheViewRay) {
  Field field = randomField({.count = 1});
  Ellipsoids& e = field.chunks[0].ellipsoids;
  for (int a = 0; a < 3; ++a) e.center[a][0] = 20.0f;
  for (int a = 0; a < 4; ++a) e.rotation[a][0] = a == 0 ? 1.0f : 0.0f;
  e.logScale[0][0] = e.logScale[1][0] = std::log(0.4f), e.logScale[2][0] = std::log(15.0f);
  e.intensity[0] = 1.0f;
  RenderOptions o = sumOptions({.eye = Vec3{20, 20, 120}, .center = Vec3{20, 20, 20}}, {51, 51});
  o.transfer = viridis({0.0f, 1.0f});
  EXPECT_GE(sumAgreement(field, o), kAskedOfSums);
}

TEST(RenderField, AgreesForOneEllipsoidThatCoversEverything) {
  EXPECT_GE(sumAgreement(oneEllipsoid(300.0), sumOptions()), kAskedOfSums);
}

TEST(RenderField, AgreesForEachKernel) {
  for (const float kappa : {-3.0f, 0.0f, 12.0f})
    EXPECT_GE(sumAgreement(randomField({.kappa = kappa}), sumOptions({}, {25, 18})), kAskedOfSums)
        << kappa;
  EXPECT_GE(sumAgreement(ownKappas(), sumOptions()), kAskedOfSums);
}

TEST(RenderField, AgreesForOtherSteps) {
  for (const double step : {0.3, 2.5}) {
    RenderOptions o = sumOptions({}, {25, 18});
    o.step = step;
    EXPECT_GE(sumAgreement(randomField({}), o), kAskedOfSums) << step;
  }
}

TEST(RenderField, AgreesWithABackgroundAndSeveralChunks) {
  EXPECT_GE(sumAgreement(twoChunks(), sumOptions()), kAskedOfSums);
}

TEST(RenderField, FarCamerasLoseNothing) {
  // From 1e5 times the volume's size, 4e6 voxels, the picture shows the same ellipsoids, with about
  // 1e-9 voxel of rounding in float64.
  const Vec3 away{1e6, 2e6, 3.3e6};
  CameraWish wish{.eye = sum(away, {20, 20, 20}), .center = Vec3{20, 20, 20}};
  wish.fov = 2.0 * std::atan(30.0 / length(away)) * 180.0 / 3.14159265358979;
  RenderOptions o = sumOptions(wish, {20, 20});
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
  const RenderOptions o = sumOptions({}, {130, 70});
  expectSameOnAnyThreads([&] { return renderField(field, o).rgba; });
}

TEST(RenderField, TheEndOfARayCostsLittle) {
  RenderOptions early = sumOptions(), never = sumOptions();
  early.opacityLength = never.opacityLength = 0.5;
  never.minTransmittance = 0.0;
  const Field field = randomField({.count = 100});
  EXPECT_LE(largestDifference(renderField(field, early), renderField(field, never)),
            early.minTransmittance * 1.01);
}

TEST(RenderField, WhatIsNotSeenIsTransparent) {
  expectTransparent(renderField(randomField({}), sumOptions(away())));
  expectTransparent(renderField(Field{}, sumOptions()));
}

TEST(RenderField, APixelAloneIsAPicture) {
  EXPECT_GE(sumAgreement(randomField({.count = 200}), sumOptions({}, {1, 1})), kAskedOfSums);
}

TEST(RenderField, FullOpacityShowsTheFirstSampleAndNoneShowsNothing) {
  RenderOptions o = sumOptions();
  o.transfer.opacity = {{0.0, 1.0}};
  const Image opaque = renderField(randomField({}), o);
  for (std::size_t i = 3; i < opaque.rgba.size(); i += 4)
    ASSERT_TRUE(opaque.rgba[i] == 0.0f || opaque.rgba[i] == 1.0f);
  o.transfer.opacity = {{0.0, 0.0}};
  expectTransparent(renderField(randomField({}), o));
}

TEST(RenderField, ATransferFunctionBesideTheDataIsTheColorAtItsEnd) {
  const Field field = withoutNegatives(randomField({.count = 50}));
  RenderOptions o = sumOptions();
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
    RenderOptions o = sumOptions();
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
  RenderOptions o = sumOptions();
  o.cancel = &cancel;
  EXPECT_THROW((void)renderField(randomField({}), o), Cancelled);
}

// A file may contain such a support. Without the limits, the rays and the list of bricks would have
// no end.
TEST(RenderField, SupportsOfAnySizeAreRefused) {
  for (const float logScale : {18.0f, 32.0f}) {
    Field field = randomField({.count = 3});
    for (auto& scale : field.chunks[0].ellipsoids.logScale) scale[1] = logScale;
    RenderOptions o = sumOptions({}, {4, 4});
    o.between = Between::kSum;
    EXPECT_THROW((void)renderField(field, o), UsageError) << logScale;
    o.between = Between::kVoxels;
    EXPECT_THROW((void)renderField(field, o), MemoryExceeded) << logScale;
  }
}

// Bounds.

constexpr Resolution kPicture{70, 50};

struct Meeting {
  bool any = false;
  int firstColumn = kPicture.width, lastColumn = -1, firstRow = kPicture.height, lastRow = -1;
  double nearest = 1e30, farthest = -1e30;  // depths along forward where rays enter and leave

  void add(int column, int row, double entry, double exit) {
    any = true;
    firstColumn = std::min(firstColumn, column), lastColumn = std::max(lastColumn, column);
    firstRow = std::min(firstRow, row), lastRow = std::max(lastRow, row);
    nearest = std::min(nearest, entry), farthest = std::max(farthest, exit);
  }
};

Vec3 times(const Matrix3& m, const Vec3& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}

/// Solves |o + t v|^2 = cutoff in the unit frame.
void addRay(const Field& field, const View& view, int column, int row, Meeting& meeting) {
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  const Ray ray = view.ray(column, row);
  const Matrix3 L = unitFrame(e, 0);
  const Vec3 center{e.center[0][0], e.center[1][0], e.center[2][0]};
  const Vec3 o = times(L, difference(ray.origin, center)), v = times(L, ray.direction);
  const double a = inner(v, v), b = inner(o, v);
  const double c = inner(o, o) - kernelConstants<double>(field.kernel).cutoff;
  if (b * b < a * c) return;
  const double root = std::sqrt(b * b - a * c), depth = inner(ray.direction, view.forward);
  if ((-b + root) / a < 0.0) return;  // behind the eye
  meeting.add(column, row, std::max(0.0, (-b - root) / a) * depth, (-b + root) / a * depth);
}

Meeting meetingOf(const Field& field, const View& view) {
  Meeting meeting;
  for (int row = 0; row < kPicture.height; ++row)
    for (int column = 0; column < kPicture.width; ++column)
      addRay(field, view, column, row, meeting);
  return meeting;
}

void expectWithin(const Meeting& m, const ScreenBounds& b) {
  EXPECT_LE(b.firstColumn, m.firstColumn);
  EXPECT_GE(b.lastColumn, m.lastColumn);
  EXPECT_LE(b.firstRow, m.firstRow);
  EXPECT_GE(b.lastRow, m.lastRow);
  EXPECT_LE(b.nearest, m.nearest + 1e-9);
  EXPECT_GE(b.farthest, m.farthest - 1e-9);
}

void expectTight(const Meeting& m, const ScreenBounds& b) {
  EXPECT_GE(b.firstColumn, m.firstColumn - 1);
  EXPECT_LE(b.lastColumn, m.lastColumn + 1);
  EXPECT_GE(b.firstRow, m.firstRow - 1);
  EXPECT_LE(b.lastRow, m.lastRow + 1);
}

Camera cameraFor(Projection projection, const Vec3& eye) {
  CameraWish wish{.eye = eye, .center = Vec3{20, 20, 20}, .fov = 45.0};
  wish.projection = projection;
  return fitCamera(kFieldBox, wish, kPicture);
}

class Bounds : public testing::TestWithParam<Projection> {};

TEST_P(Bounds, HoldEveryPixelThatMeetsTheSupport) {
  int met = 0;
  for (const Vec3& eye : {Vec3{60, 45, 90}, Vec3{21, 19, 22}, Vec3{5, 30, 35}})
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      const Field field = randomField({.count = 1, .smallest = 0.5, .aspect = 20.0, .seed = seed});
      const View view(cameraFor(GetParam(), eye), kPicture);
      const Meeting meeting = meetingOf(field, view);
      const auto visible = visibleEllipsoids(field, view, kPicture);
      if (!meeting.any) continue;
      ++met;
      ASSERT_EQ(visible.bounds.size(), 1u) << "seed " << seed;
      expectWithin(meeting, visible.bounds[0]);
    }
  EXPECT_GT(met, 40);
}

TEST_P(Bounds, AreNoLargerThanNeeded) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Field field = randomField({.count = 1, .smallest = 3.0, .aspect = 1.5, .seed = seed});
    const View view(cameraFor(GetParam(), {60, 45, 90}), kPicture);
    const Meeting meeting = meetingOf(field, view);
    ASSERT_TRUE(meeting.any);
    expectTight(meeting, visibleEllipsoids(field, view, kPicture).bounds.at(0));
  }
}

INSTANTIATE_TEST_SUITE_P(Projections, Bounds,
                         testing::Values(Projection::kPerspective, Projection::kOrthographic));

TEST(VisibleEllipsoids, LeaveOutWhatLiesBehindTheEye) {
  const Field field = randomField({.count = 10});
  const Camera away{.eye = {20, 20, 100}, .center = {20, 20, 200}, .up = {0, 1, 0}};
  EXPECT_TRUE(visibleEllipsoids(field, View(away, kPicture), kPicture).bounds.empty());
}

// Modes and clip boxes.

RenderOptions optionsOf(RenderMode mode, Projection projection = Projection::kPerspective) {
  RenderOptions o = sumOptions({.projection = projection}, {30, 22});
  o.mode = mode;
  return o;
}

/// The modes by their definition.
struct Gathered {
  double largest = -std::numeric_limits<double>::infinity(), sum = 0.0, depth = 0.0;
  int count = 0;

  void add(double value) { largest = std::max(largest, value), sum += value, ++count; }
};

Gathered gather(const ValueAtPlace& valueAt, const Ray& ray, const Integrals& integrals,
                double step) {
  Gathered all;
  LightOnRay light(integrals, 0.0, Classification::kPreIntegrated);
  for (int j = 0; j < 400; ++j) {
    const double value = valueAt(sum(ray.origin, scaled(ray.direction, j * step)));
    if (value != 0.0) all.add(value);
    light.add(value);
    if (all.depth == 0.0 && light.light().transmittance < 0.5) all.depth = j * step;
  }
  return all;
}

std::array<double, 4> colored(double value, const TransferFunction& f) {
  const Rgb c = colorAt(f.colors, value);
  const double alpha = opacityAt(f.opacity, value);
  return {c.r * alpha, c.g * alpha, c.b * alpha, alpha};
}

std::array<double, 4> expected(const Gathered& all, const RenderOptions& o) {
  if (o.mode == RenderMode::kDepth) return {all.depth, 0.0, 0.0, all.depth > 0.0 ? 1.0 : 0.0};
  if (all.count == 0) return {};
  return colored(o.mode == RenderMode::kMaximum ? all.largest : all.sum / all.count, o.transfer);
}

/// The share of the pixels that differ by more than a tolerance.
double shareOff(const Field& field, const RenderOptions& o, double tolerance) {
  const ValueAtPlace value = sumOfEllipsoids(field);
  const View view(o.camera, o.resolution);
  const Integrals integrals(o.transfer, o.step / o.opacityLength);
  const Image drawn = renderField(field, o);
  int off = 0, lit = 0;
  for (int row = 0; row < drawn.height; ++row)
    for (int column = 0; column < drawn.width; ++column) {
      const auto want = expected(gather(value, view.ray(column, row), integrals, o.step), o);
      const float* pixel = &drawn.rgba[std::size_t(4 * (row * drawn.width + column))];
      bool differs = false;
      for (int c = 0; c < 4; ++c) differs |= !(std::abs(pixel[c] - want[c]) <= tolerance);
      off += differs, lit += want[3] > 0.0;
    }
  EXPECT_GT(lit, 50) << "an empty picture proves nothing";
  return double(off) / double(drawn.width * drawn.height);
}

TEST(RenderModes, SlowShowTheLargestAndTheMeanValue) {
  const Field field = randomField({.count = 40});
  for (const auto projection : {Projection::kPerspective, Projection::kOrthographic})
    for (const auto mode : {RenderMode::kMaximum, RenderMode::kAverage})
      // A sample at the end of a support has the value 0, and may count in one picture only.
      EXPECT_LE(shareOff(field, optionsOf(mode, projection), 1e-3), 0.02);
}

TEST(RenderModes, SlowShowHowDeepHalfOfTheLightComes) {
  const Field field = randomField({.count = 200});
  EXPECT_LE(shareOff(field, optionsOf(RenderMode::kDepth), 1e-3), 0.005);
  RenderOptions o = optionsOf(RenderMode::kDepth);
  o.between = Between::kVoxels;
  const Image expected = renderVolume(revoxelise(field, {}), o), drawn = renderField(field, o);
  int off = 0;
  for (std::size_t i = 0; i < drawn.rgba.size(); ++i) off += drawn.rgba[i] != expected.rgba[i];
  EXPECT_LE(off, int(drawn.rgba.size() / 200));
}

TEST(RenderModes, OfVoxelsAreThoseOfTheirField) {
  const Field field =
      withoutNegatives(randomField({.count = 25, .smallest = 8.0, .aspect = 1.5, .kappa = 0.0f}));
  const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
  for (const auto mode : {RenderMode::kMaximum, RenderMode::kAverage}) {
    RenderOptions o = optionsOf(mode);
    o.transfer = rescaled(o.transfer, {0.0f, 5.0f});
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 35.0);
    o.between = Between::kVoxels;
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 70.0);
  }
}

TEST(ClipBox, LeavesWhatIsInIt) {
  const Field field = randomField({.count = 200});
  const auto whole = sumOfEllipsoids(field);
  for (const PlaceBox& box : {PlaceBox{{5.3, 0.1, -100}, {22.2, 31.7, 100}},
                              PlaceBox{{20.01, -100, -100}, {21.03, 100, 100}}}) {
    RenderOptions o = optionsOf(RenderMode::kComposite);
    o.clip = box;
    o.lod = LevelOfDetail::kOff;
    const auto clipped = [&](const Vec3& p) {
      for (int a = 0; a < 3; ++a)
        if (p[a] < box.low[a] || p[a] > box.high[a]) return 0.0;
      return whole(p);
    };
    EXPECT_GE(imagePsnr(referencePicture({clipped, 0.0, 300.0, false}, o), renderField(field, o)),
              70.0);
    const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 24.0) << "roughly";
    o.between = Between::kVoxels;
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 70.0);
  }
}

TEST(ClipBox, MustNotEndBeforeItBegins) {
  RenderOptions o = optionsOf(RenderMode::kComposite);
  o.clip = PlaceBox{{1, 0, 0}, {0, 1, 1}};
  EXPECT_THROW((void)renderField(Field{}, o), UsageError);
  o.clip = PlaceBox{{std::nan(""), 0, 0}, {0, 1, 1}};
  EXPECT_THROW((void)renderVolume(SparseVolume{}, o), UsageError);
}

}  // namespace
}  // namespace esvr::test
