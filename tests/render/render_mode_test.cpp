// Plan: the largest value, the mean, the depth of half the light along each ray, and a clip box
// agree with the same quantities computed in float64 from every sample, for both renderers. The
// differences are those of render_field_test.cpp. A depth may differ by one sample where the light
// is almost half, so a few pixels may differ there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "render/reference_light.h"
#include "render/reference_picture.h"
#include "render/vector.h"
#include "render/view.h"

namespace esvr::test {
namespace {

constexpr Box kBox{{0, 0, 0}, {39, 39, 39}};

RenderOptions optionsFor(RenderMode mode, Projection projection = Projection::kPerspective) {
  RenderOptions o;
  o.mode = mode;
  o.resolution = {30, 22};
  o.camera = fitCamera(kBox, {.projection = projection}, o.resolution);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 8.0;
  o.between = Between::kSum;
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
      EXPECT_LE(shareOff(field, optionsFor(mode, projection), 1e-3), 0.02);
}

TEST(RenderModes, SlowShowHowDeepHalfOfTheLightComes) {
  const Field field = randomField({.count = 200});
  EXPECT_LE(shareOff(field, optionsFor(RenderMode::kDepth), 1e-3), 0.005);
  RenderOptions o = optionsFor(RenderMode::kDepth);
  o.between = Between::kVoxels;
  const Image expected = renderVolume(revoxelise(field, {}), o), drawn = renderField(field, o);
  int off = 0;
  for (std::size_t i = 0; i < drawn.rgba.size(); ++i) off += drawn.rgba[i] != expected.rgba[i];
  EXPECT_LE(off, int(drawn.rgba.size() / 200));
}

TEST(RenderModes, OfVoxelsAreThoseOfTheirField) {
  Field field = randomField({.count = 25, .smallest = 8.0, .aspect = 1.5, .kappa = 0.0f});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
  for (const auto mode : {RenderMode::kMaximum, RenderMode::kAverage}) {
    RenderOptions o = optionsFor(mode);
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
    RenderOptions o = optionsFor(RenderMode::kComposite);
    o.clip = box;
    o.lod = LevelOfDetail::kOff;
    const auto clipped = [&](const Vec3& p) {
      for (int a = 0; a < 3; ++a)
        if (p[a] < box.low[a] || p[a] > box.high[a]) return 0.0;
      return whole(p);
    };
    EXPECT_GE(imagePsnr(referencePicture({clipped, 0.0, 300.0}, o), renderField(field, o)), 70.0);
    const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 24.0) << "roughly";
    o.between = Between::kVoxels;
    EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 70.0);
  }
}

TEST(ClipBox, MustNotEndBeforeItBegins) {
  RenderOptions o = optionsFor(RenderMode::kComposite);
  o.clip = PlaceBox{{1, 0, 0}, {0, 1, 1}};
  EXPECT_THROW((void)renderField(Field{}, o), UsageError);
  o.clip = PlaceBox{{std::nan(""), 0, 0}, {0, 1, 1}};
  EXPECT_THROW((void)renderVolume(SparseVolume{}, o), UsageError);
}

}  // namespace
}  // namespace esvr::test
