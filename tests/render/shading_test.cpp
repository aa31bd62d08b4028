// Plan: the light of a surface follows the definition in render.h: a plane of known gradient, seen
// straight on and tilted, has the diffuse part and the highlight that are computed here in float64.
// Gradients agree with the derivatives of a quadratic function. The cells of a field and volumes give
// the same shaded pictures. What cannot be shaded is refused.
#include "render/shading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/random_field.h"
#include "render/brick_scene.h"
#include "render/reference_picture.h"

namespace esvr::test {
namespace {

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
  std::vector<BrickInput> bricks;
  for (int n = 0; n < 64; ++n) {
    BrickInput brick{Coord{n / 16, n / 4 % 4, n % 4} * kBrickSide, {}, {}};
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord c = brick.corner + voxelLocal(v);
      brick.values[std::size_t(v)] = 1.0f + 0.1f * float(c.x + c.z);
    }
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 0.0f);
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
  RenderOptions o;
  o.resolution = {60, 45};
  o.camera = fitCamera({{0, 0, 0}, {39, 39, 39}}, {}, o.resolution);
  o.transfer = rescaled({builtInColorMap("viridis"), builtInOpacity("linear")}, {-1.0f, 1.0f});
  o.opacityLength = 4.0;
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
  o.resolution = {12, 9};  // several levels of detail
  EXPECT_GE(imagePsnr(renderVolume(revoxelise(field, {}), o), renderField(field, o)), 60.0);
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
