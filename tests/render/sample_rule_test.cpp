// Plan: parts of a sequence of samples that are joined are as good as one part. A tilted slab and a
// tilted cube have faces whose true picture is constant along a face, so the variance of their pixels
// measures the stripes that sampling leaves there: pre-integration must leave a hundredth of the power
// that post-classification leaves, and with short steps both draw the same picture.
//
// The light of a surface follows the definition in render.h, computed here in float64, and gradients
// are the derivatives of a quadratic function.
#include "render/sample_rule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/image.h"
#include "esvr/render.h"
#include "field/random_field.h"
#include "render/reference_picture.h"
#include "render/scenes.h"

namespace esvr::test {
namespace {

// The rule.

/// The samples of a ray that are not empty space.
struct Sample {
  std::uint32_t number;
  float value;
};

std::vector<Sample> samplesWithGaps(std::uint64_t seed) {
  Random random(seed);
  std::vector<Sample> samples;
  for (std::uint32_t n = 0; n < 60; ++n)
    if (random(0.0, 1.0) < 0.8) samples.push_back({n, float(random(0.1, 1.0))});
  return samples;
}

struct Ruled {
  explicit Ruled(RenderMode mode, Classification classification = Classification::kPreIntegrated) {
    options.mode = mode, options.classification = classification;
    options.transfer = {builtInColorMap("turbo"), builtInOpacity("linear")};
    options.opacityLength = 10.0;
    table.emplace(options.transfer, samplingOf(options));
  }
  [[nodiscard]] SampleRule rule() const { return sampleRule(options, table->view(), 0.0f); }
  void add(RayState& ray, const Sample& s) const {
    rule().add(ray, s.value, {float(s.number), s.number});
  }

  RenderOptions options;
  std::optional<TransferTable> table;
};

void expectSame(const PixelColor& a, const PixelColor& b, float tolerance = 1e-5f) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
  EXPECT_NEAR(a.alpha, b.alpha, tolerance);
}

/// Divides the samples at the given numbers, and joins the parts.
PixelColor joined(const Ruled& ruled, const std::vector<Sample>& samples,
                  const std::vector<std::uint32_t>& ends) {
  RayState ray, part;
  std::size_t next = 0;
  for (const Sample& s : samples) {
    for (; next < ends.size() && s.number >= ends[next]; ++next) {
      if (next == 0) ray = part;
      if (next > 0) ruled.rule().join(ray, part);
      part = RayState::behind();
    }
    ruled.add(part, s);
  }
  if (!ends.empty()) ruled.rule().join(ray, part);
  return ruled.rule().finished(ends.empty() ? part : ray);
}

TEST(SampleRule, PartsThatAreJoinedAreTheWholeRay) {
  for (const auto classification : {Classification::kPreIntegrated, Classification::kPost})
    for (const auto mode : {RenderMode::kComposite, RenderMode::kMaximum, RenderMode::kAverage}) {
      const Ruled ruled(mode, classification);
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const auto samples = samplesWithGaps(seed);
        const PixelColor whole = joined(ruled, samples, {});
        expectSame(joined(ruled, samples, {30}), whole);
        expectSame(joined(ruled, samples, {1, 7, 8, 9, 20, 20, 45}), whole);
      }
    }
}

TEST(SampleRule, PartsBehindARayThatHasNoSamplesBeginIt) {
  const Ruled ruled(RenderMode::kComposite);
  RayState ray, front = RayState::behind(), next = RayState::behind();
  const RayState none = RayState::behind();
  for (const std::uint32_t n : {3u, 4u}) ruled.add(front, {n, 0.5f});
  ruled.add(next, {5u, 0.75f});
  RayState both = none;
  ruled.rule().join(both, front), ruled.rule().join(both, none), ruled.rule().join(both, next);
  ruled.rule().join(ray, none), ruled.rule().join(ray, both);
  const std::vector<Sample> samples{{3u, 0.5f}, {4u, 0.5f}, {5u, 0.75f}};
  expectSame(ruled.rule().finished(ray), joined(ruled, samples, {}));
}

TEST(SampleRule, EmptySpaceIsEnteredAndLeftAtTheBackground) {
  const Ruled ruled(RenderMode::kComposite);
  const auto& segment = ruled.table->view().segments;
  const auto left = [&](float a, float b) { return 1.0f - segment(a, b).alpha; };
  const auto alpha = [&](const std::vector<Sample>& s) { return joined(ruled, s, {}).alpha; };
  EXPECT_EQ(alpha({}), 0.0f);
  EXPECT_NEAR(alpha({{4, 0.5f}}), 1.0f - left(0, 0.5f) * left(0.5f, 0), 1e-6);
  EXPECT_NEAR(alpha({{0, 0.5f}, {1, 0.9f}}),
              1.0f - left(0, 0.5f) * left(0.5f, 0.9f) * left(0.9f, 0), 1e-6);
  EXPECT_NEAR(alpha({{0, 0.5f}, {2, 0.9f}}),
              1.0f - left(0, 0.5f) * left(0.5f, 0) * left(0, 0.9f) * left(0.9f, 0), 1e-6);
}

TEST(SampleRule, ADistanceIsTheEndOfTheSegmentThatTakesHalfOfTheLight) {
  Ruled ruled(RenderMode::kDepth);
  ruled.options.opacityLength = 1.0;
  ruled.table.emplace(ruled.options.transfer, samplingOf(ruled.options));
  const auto depth = [&](const std::vector<Sample>& s) { return joined(ruled, s, {}); };
  EXPECT_EQ(depth({{7, 0.1f}}).alpha, 0.0f);
  EXPECT_EQ(depth({{7, 0.8f}}).r, 7.0f + 1.0f) << "the ray loses 45 % on the way in";
  EXPECT_EQ(depth({{7, 0.1f}, {8, 1.0f}, {9, 0.5f}}).r, 8.0f);
  EXPECT_EQ(depth({{7, 0.8f}, {12, 1.0f}}).r, 8.0f);
}

// Classification.

constexpr int kSide = 48;  // voxels
constexpr double kMiddle = kSide / 2.0;
constexpr double kLessPower = 100.0;

/// A volume whose voxels have the values of a function of their places.
template <class Value>
SparseVolume sampled(float background, const Value& value) {
  return cubeOf(kSide / kBrickSide, background, [&](Coord at) {
    return value(Vec3{double(at.x), double(at.y), double(at.z)});
  });
}

/// A slab of 20 voxels whose values fall from 1 to 0 within 3 voxels on both sides.
SparseVolume slab() {
  const Vec3 normal = unit({0.3, 0.1, 1.0});
  return sampled(0.0f, [&](const Vec3& p) {
    const double away = std::abs(inner(normal, difference(p, {kMiddle, kMiddle, kMiddle})));
    return std::clamp((10.0 - away) / 3.0 + 0.5, 0.0, 1.0);
  });
}

/// The level set of a cube with sides of 24 voxels, with a narrow band of 3 voxels to each side.
SparseVolume tiltedCube() {
  const Vec3 x = unit({1.0, 0.2, 0.3}), z = unit(cross(x, {0.1, 1.0, 0.2})), y = cross(z, x);
  return sampled(3.0f, [&](const Vec3& p) {
    const Vec3 d = difference(p, {kMiddle, kMiddle, kMiddle});
    const double away =
        std::max({std::abs(inner(x, d)), std::abs(inner(y, d)), std::abs(inner(z, d))});
    return std::clamp(away - 12.0, -3.0, 3.0);
  });
}

/// The picture of a square of some voxels in the middle of the volume.
RenderOptions closeUp(double voxels, const TransferFunction& transfer) {
  RenderOptions o =
      pictureOf({{0, 0, 0}, {kSide - 1, kSide - 1, kSide - 1}}, {64, 64}, 1.0, orthographic());
  o.camera.center = {kMiddle, kMiddle, kMiddle};
  o.camera.eye = {kMiddle, kMiddle, 100.37};
  o.camera.up = {0, 1, 0};
  o.camera.height = voxels;
  o.transfer = transfer;
  return o;
}

/// The power of all that is not constant in a channel of a picture.
double variance(const Image& image, std::size_t channel) {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = channel; i < image.rgba.size(); i += 4)
    sum += image.rgba[i], squares += double(image.rgba[i]) * image.rgba[i];
  const double mean = 4.0 * sum / double(image.rgba.size());
  return 4.0 * squares / double(image.rgba.size()) - mean * mean;
}

double stripes(const SparseVolume& volume, RenderOptions o, Classification classification) {
  o.classification = classification;
  return variance(renderVolume(volume, o), 1);
}

void expectFewStripes(const SparseVolume& volume, const RenderOptions& o) {
  const double post = stripes(volume, o, Classification::kPost);
  EXPECT_GT(post, 1e-4) << "without stripes there is nothing to compare";
  EXPECT_LE(stripes(volume, o, Classification::kPreIntegrated), post / kLessPower);
}

TEST(Classification, AFlatSurfaceHasNoStripes) {
  for (const char* colors : {"viridis", "grayscale"})
    for (const OpacityCurve& curve :
         {builtInOpacity("step"), OpacityCurve{{0.0, 0.0}, {0.45, 0.0}, {0.55, 0.99}, {1.0, 1.0}}})
      expectFewStripes(slab(), closeUp(24.0, {builtInColorMap(colors), curve}));
}

TEST(Classification, ALevelSetHasNoMoire) {
  const TransferFunction surface =
      rescaled({builtInColorMap("viridis"), {{0.0, 1.0}, {0.5, 1.0}, {0.5, 0.0}, {1.0, 0.0}}},
               {-3.0f, 3.0f});
  expectFewStripes(tiltedCube(), closeUp(8.0, surface));
}

/// A box of 16 voxels a side in which all values are 1.
SparseVolume box() {
  return sampled(0.0f, [](const Vec3& p) {
    const auto isInside = [](double x) { return x >= 16.0 && x < 32.0; };
    return isInside(p[0]) && isInside(p[1]) && isInside(p[2]) ? 1.0 : 0.0;
  });
}

/// The level set of the same box.
SparseVolume boxLevelSet() {
  return sampled(3.0f, [](const Vec3& p) {
    double away = -3.0;
    for (const double x : p) away = std::max({away, 15.5 - x, x - 31.5});
    return std::min(away, 3.0);
  });
}

/// Seen from a direction in which samples lie at all distances from the faces.
RenderOptions tilted(double voxels, const TransferFunction& transfer, const Vec3& from) {
  RenderOptions o = closeUp(voxels, transfer);
  o.camera.center = {23.5, 23.5, 23.5};
  o.camera.eye = sum(o.camera.center, scaled(unit(from), 60.0));
  o.minTransmittance = 0.0;
  return o;
}

constexpr double kFine = 0.04;  // a step at which pictures no longer depend on the step

/// The largest difference of a picture from that with short steps.
double fromFine(const SparseVolume& volume, RenderOptions o) {
  const Image drawn = renderVolume(volume, o);
  o.step = kFine;
  return largestDifference(drawn, renderVolume(volume, o));
}

/// A thin body, whose opacity is that of the distance through it, and a dense one.
const std::array kBodies{OpacityCurve{{0.0, 0.0}, {1.0, 0.1}}, OpacityCurve{{0.0, 0.0}, {1.0, 0.9}},
                         builtInOpacity("linear")};

// The picture of a face that is parallel to the faces of voxels is constant for parallel rays.
TEST(Classification, SlowAFaceOfAConstantBodyHasNoStripes) {
  for (const OpacityCurve& curve : kBodies)
    for (const Vec3& from : {Vec3{1.0, 0.11, 0.17}, Vec3{0.12, 0.19, -1.0}}) {
      const RenderOptions o = tilted(4.0, {builtInColorMap("viridis"), curve}, from);
      EXPECT_LE(variance(renderVolume(box(), o), 1), 2e-5);
      EXPECT_LE(fromFine(box(), o), 0.06);
    }
}

TEST(Classification, SlowAFaceThatIsClippedHasNoStripes) {
  for (const OpacityCurve& curve : kBodies)
    for (const Vec3& from : {Vec3{1.0, 0.11, 0.17}, Vec3{0.12, 0.19, -1.0}}) {
      RenderOptions o = tilted(4.0, {builtInColorMap("viridis"), curve}, from);
      o.clip = PlaceBox{{18.3, 18.3, 18.3}, {28.7, 28.7, 28.7}};
      EXPECT_LE(fromFine(box(), o), 0.12);
    }
}

/// The share of pixels that are covered with short steps and not with steps of a voxel, or the
/// other way around.
double frayed(const SparseVolume& volume, RenderOptions o) {
  const Image drawn = renderVolume(volume, o);
  o.step = kFine;
  const Image fine = renderVolume(volume, o);
  double count = 0.0;
  for (std::size_t i = 3; i < fine.rgba.size(); i += 4)
    count += std::abs(drawn.rgba[i] - fine.rgba[i]) > 0.5f ? 1.0 : 0.0;
  return count / double(fine.rgba.size() / 4);
}

TEST(Classification, TheSilhouetteOfALevelSetIsThatOfShortSteps) {
  const RenderOptions o = tilted(30.0, levelSetSurface(3.0), {1.0, 0.35, 0.6});
  EXPECT_LE(frayed(boxLevelSet(), o), 0.0005);
}

TEST(Classification, TheSilhouetteOfAClipBoxIsThatOfShortSteps) {
  RenderOptions o =
      tilted(30.0, {builtInColorMap("viridis"), builtInOpacity("linear")}, {1.0, 0.35, 0.6});
  o.clip = PlaceBox{{18.3, 18.3, 18.3}, {28.7, 28.7, 28.7}};
  EXPECT_LE(frayed(box(), o), 0.005);
}

// The same silhouette with 16 rays a pixel: a pixel at the edge is covered in part, so that one ray
// errs by at most a pixel, as many as the silhouette has, but not by more.
TEST(Classification, SlowTheSilhouetteOfALevelSetIsCloseToThatOfManyRays) {
  RenderOptions o = tilted(30.0, levelSetSurface(3.0), {1.0, 0.35, 0.6});
  const Image drawn = renderVolume(boxLevelSet(), o);
  RenderOptions fine = o;
  fine.step = kFine;
  const Image oneRay = renderVolume(boxLevelSet(), fine);
  o.resolution = {256, 256};
  o.step = 0.1;  // no ray of many needs to be as exact as the one
  const Image many = meansOfSquares(renderVolume(boxLevelSet(), o), 4);
  EXPECT_GE(imagePsnr(drawn, many), imagePsnr(oneRay, many) - 0.3);
}

TEST(Classification, BothRulesAgreeAtShortSteps) {
  RenderOptions o = closeUp(60.0, {builtInColorMap("viridis"), builtInOpacity("smoke")});
  o.resolution = {24, 24};
  const SparseVolume volume = slab();
  const auto difference = [&](double step) {
    o.step = step, o.minTransmittance = 0.0;
    o.classification = Classification::kPost;
    const Image post = renderVolume(volume, o);
    o.classification = Classification::kPreIntegrated;
    return largestDifference(renderVolume(volume, o), post);
  };
  EXPECT_GT(difference(1.0), 0.01);
  EXPECT_LE(difference(0.02), 1e-3);
}

TEST(Classification, BricksThatHoldOnlyTheBackgroundChangeNothing) {
  const SparseVolume volume = randomBricks({{0, 0, 0}, {16, 8, 24}}, 11, 0.5f);
  auto bricks = bricksOf(volume);
  for (const Coord corner : {Coord{8, 0, 0}, Coord{8, 8, 16}, Coord{0, 0, 8}, Coord{24, 8, 24}}) {
    bricks.push_back({corner, {}, {}});
    bricks.back().values.fill(0.5f);
  }
  const RenderOptions o = optionsFor(volume);
  EXPECT_LE(largestDifference(renderVolume(makeVolume(std::move(bricks), 0.5f), o),
                              renderVolume(volume, o)),
            1e-6);
}

// Shading.

constexpr double kPi = 3.14159265358979;

TEST(Shading, GradientsAreDerivatives) {
  const auto value = [](const FloatPlace& p) {
    return 3.0f * p.x - 0.5f * p.y * p.y + 0.25f * p.x * p.z;
  };
  for (const FloatPlace& p : {FloatPlace{4.0f, 3.0f, 5.0f}, FloatPlace{2.25f, 6.5f, 1.75f}}) {
    const FloatPlace g = gradientAt(p, 8.0f, value);
    EXPECT_NEAR(g.x, 3.0f + 0.25f * p.z, 1e-5);  // a difference is exact for a quadratic function
    EXPECT_NEAR(g.y, -p.y, 1e-5);
    EXPECT_NEAR(g.z, 0.25f * p.x, 1e-5);
  }
  // At a face, the difference is taken over half a voxel to one side.
  EXPECT_NEAR(gradientAt({4.0f, 8.0f, 4.0f}, 8.0f, value).y, -7.75f, 1e-5);
  EXPECT_NEAR(gradientAt({4.0f, 0.0f, 4.0f}, 8.0f, value).y, -0.25f, 1e-5);
}

LightRule rule(float weak = 0.0f) {
  return {{0.0f, 0.0f, 1.0f}, 0.3f, 0.6f, 0.4f, 8.0f, weak * weak};
}

TEST(Shading, FollowsTheAngleToTheLight) {
  const FloatPlace direction{0.0f, 0.0f, -1.0f};
  for (const double degrees : {0.0, 30.0, 60.0, 90.0, 150.0}) {
    const double angle = degrees * kPi / 180.0;
    const FloatPlace gradient{5.0f * float(std::sin(angle)), 0.0f, 5.0f * float(std::cos(angle))};
    const Shade shade = rule().shadeOf(gradient, direction);
    EXPECT_NEAR(shade.color, 0.3 + 0.6 * std::abs(std::cos(angle)), 1e-6) << degrees;
    EXPECT_NEAR(shade.white, 0.4 * std::pow(std::abs(std::cos(angle)), 8.0), 1e-6) << degrees;
  }
}

TEST(Shading, HasItsHighlightHalfwayToTheEye) {
  const FloatPlace direction{-1.0f, 0.0f, 0.0f};  // the eye lies along x, the light along z
  const auto highlight = [&](double degrees) {
    const double angle = degrees * kPi / 180.0;
    const FloatPlace n{float(std::sin(angle)), 0.0f, float(std::cos(angle))};
    return rule().shadeOf(n, direction).white;
  };
  EXPECT_NEAR(highlight(45.0), 0.4, 1e-6);
  EXPECT_NEAR(highlight(65.0), 0.4 * std::pow(std::cos(20.0 * kPi / 180.0), 8.0), 1e-6);
}

TEST(Shading, FadesWhereGradientsAreWeak) {
  const FloatPlace across{0.1f, 0.0f, 0.0f}, along{0.0f, 0.0f, 0.1f}, direction{0.0f, 0.0f, -1.0f};
  EXPECT_NEAR(rule(0.1f).shadeOf(across, direction).color, 0.3 + 0.6 * 0.5, 1e-6) << "halfway";
  EXPECT_NEAR(rule(10.0f).shadeOf(across, direction).color, 0.9, 1e-3);
  EXPECT_NEAR(rule(0.1f).shadeOf(along, direction).white, 0.4 * 0.5, 1e-6);
}

TEST(Shading, PlacesWithoutAGradientAreLitFromTheFront) {
  const Shade shade = rule().shadeOf({0, 0, 0}, {0, 0, -1});
  EXPECT_FLOAT_EQ(shade.color, 0.9f);
  EXPECT_EQ(shade.white, 0.0f);
  const Shade behind = rule().shadeOf({1, 0, 0}, {0, 0, 1});  // the light shines at the eye
  EXPECT_TRUE(std::isfinite(behind.white));
}

/// A slope: values grow along x and z, so that its surface is tilted by 45 degrees.
SparseVolume slope() {
  return cubeOf(4, 0.0f, [](Coord at) { return 1.0f + 0.1f * float(at.x + at.z); });
}

RenderOptions seenAlongX(const Vec3& light) {
  RenderOptions o;
  o.resolution = {9, 9};
  o.camera = {.eye = {-50, 16, 16}, .center = {16, 16, 16}, .up = {0, 1, 0}};
  o.camera.projection = Projection::kOrthographic;
  o.camera.height = 9.0;
  o.transfer.colors = builtInColorMap("grayscale");
  for (ColorPoint& point : o.transfer.colors.points) point.color = {0.5, 0.5, 0.5};
  o.transfer.opacity = {{2.7, 0.0}, {2.8, 1.0}};
  o.shading = Shading{.light = light, .ambient = 0.2, .diffuse = 0.8, .specular = 0.0};
  return o;
}

TEST(Shading, OfATiltedPlaneIsThatOfItsNormal) {
  const SparseVolume volume = slope();
  for (const Vec3& light : {Vec3{-1, 0, 0}, Vec3{-1, 0, -1}, Vec3{-1, 0, 1}, Vec3{0, 2, 0}}) {
    const double facing = std::abs(light[0] + light[2]) / std::sqrt(2.0 * inner(light, light));
    const Image image = renderVolume(volume, seenAlongX(light));
    const std::size_t middle = 4 * (4 * 9 + 4);
    EXPECT_NEAR(image.rgba[middle + 3], 1.0, 1e-3) << "the surface is opaque";
    // Squares of the gradient and of a weak one, which is 2 % of the range from 0 to 2.8
    const double squared = 0.02, weak = 0.056 * 0.056, strength = squared / (squared + weak);
    EXPECT_NEAR(image.rgba[middle], 0.5 * (0.2 + 0.8 * (1.0 + strength * (facing - 1.0))), 2e-3);
  }
}

TEST(Shading, OfCellsIsThatOfVolumes) {
  const Field field = randomField({.count = 200});
  RenderOptions o = pictureOf(kFieldBox, {60, 45}, 4.0);
  const Image unlit = renderField(field, o);
  o.shading = Shading{};
  for (const auto classification : {Classification::kPreIntegrated, Classification::kPost}) {
    o.classification = classification;
    const Image cells = renderField(field, o);
    // A gradient near a flat spot turns with the rounding of its values.
    EXPECT_GE(imagePsnr(renderVolume(revoxelise(field, {}), o), cells), 70.0);
    EXPECT_LT(imagePsnr(unlit, cells), 40.0);
  }
  o.camera.fov = 160.0, o.camera.eye = {20, 20, -3}, o.camera.center = {20, 20, 20};
  o.resolution = {12, 9};  // several levels of detail, which are means in both
  const auto bricks = reachedBricks(field);
  const RevoxeliseOptions rule{.bricks = bricks, .restrictToBricks = true};
  EXPECT_GE(imagePsnr(renderVolume(revoxelise(field, rule), o), renderField(field, o, rule)), 60.0);
}

TEST(Shading, IsRefusedWhereItCannotBe) {
  const Field field = randomField({.count = 3});
  RenderOptions o;
  o.resolution = {4, 4};
  o.transfer = {builtInColorMap("viridis"), builtInOpacity("linear")};
  o.shading = Shading{};
  EXPECT_NO_THROW((void)renderField(field, o));
  o.between = Between::kSum;
  EXPECT_THROW((void)renderField(field, o), UsageError);
  o.between = Between::kVoxels;
  o.mode = RenderMode::kMaximum;
  EXPECT_THROW((void)renderField(field, o), UsageError);
  o.mode = RenderMode::kComposite;
  o.shading->light = Vec3{0, 0, 0};
  EXPECT_THROW((void)renderField(field, o), UsageError);
  o.shading = Shading{.specular = -1.0};
  EXPECT_THROW((void)renderVolume(SparseVolume{}, o), UsageError);
}

}  // namespace
}  // namespace esvr::test
