// Plan: marching over bricks, which skips empty ones, agrees with float64 trilinear interpolation
// at every sample (reference_picture.h). The differences are those of render_field_test.cpp; the
// interpolation itself is float32, with errors of 1e-7 of the values. Then the two renderers are
// compared with each other.
#include <gtest/gtest.h>

#include "esvr/field.h"
#include "esvr/render.h"
#include "render/reference_picture.h"
#include "render/scenes.h"
#include "render/view.h"
#include "support/on_threads.h"

namespace esvr::test {
namespace {

constexpr double kAskedOfBricks = 70.0;

/// A few bricks far apart, some with neighbours, with random values.
SparseVolume scattered(Coord shift = {}) {
  std::vector<Coord> corners{{0, 0, 0},   {0, 0, 8},    {8, 8, 8},
                             {40, 0, 16}, {16, 40, 32}, {0, 32, 0}};
  for (Coord& corner : corners) corner = corner + shift;
  return randomBricks(corners, 3);
}

double brickAgreement(const SparseVolume& volume, const RenderOptions& o) {
  const double farthest = length(difference(o.camera.eye, o.camera.center)) + 100.0;
  const SampledScene scene{[&](const Vec3& place) { return trilinear(volume, place); },
                           volume.background, farthest};
  return imagePsnr(referencePicture(scene, o), renderVolume(volume, o));
}

TEST(RenderVolume, AgreesWithADenseWalk) {
  const auto volume = scattered();
  EXPECT_GE(brickAgreement(volume, optionsFor(volume)), kAskedOfBricks);
  EXPECT_GE(brickAgreement(volume, optionsFor(volume, orthographic())), kAskedOfBricks);
}

TEST(RenderVolume, AgreesAlongAxesWhereSamplesLieOnTheFacesOfBricks) {
  const auto volume = scattered({-16, 8, -24});
  for (const Vec3& from : {Vec3{100, 0, 0}, Vec3{0, 0, -100}, Vec3{0, 100, 0}}) {
    RenderOptions o = optionsFor(volume, orthographic());
    o.resolution = {48, 48};
    o.camera.height = 96.0;  // a pixel is two voxels wide, so that rays pass through voxels
    o.camera.center = {8.0, 20.0, 0.0};
    o.camera.eye = sum(o.camera.center, from);
    o.camera.up = from[1] == 0.0 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
    EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
  }
}

TEST(RenderVolume, SlowVoxelsThatAreNoCubesAgreeWithADenseWalk) {
  const auto volume = scattered();
  for (const VoxelShape& voxel : {VoxelShape{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 3}}}},
                                  VoxelShape{{{{-1, 0, 0}, {0, 2, 0}, {0, 0, 1}}}},
                                  VoxelShape{{{{1, 0, 0}, {0.5, 1, 0}, {0.2, -0.3, 1.5}}}}})
    for (const auto projection : {Projection::kPerspective, Projection::kOrthographic}) {
      RenderOptions o = optionsFor(volume, {.projection = projection, .voxel = voxel});
      EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
    }
}

TEST(RenderVolume, CamerasThatAreFarAwaySeeTheVolume) {
  const auto volume = scattered();
  RenderOptions o = optionsFor(volume, orthographic());
  const Vec3 back = difference(o.camera.eye, o.camera.center);
  o.step = 0.1;
  const Image near = renderVolume(volume, o);
  for (const double times : {1e10, 1e18, 1e290}) {
    RenderOptions far = o;
    far.camera.eye = sum(o.camera.center, scaled(back, times));
    EXPECT_LE(largestDifference(renderVolume(volume, far), near), 0.05) << times;
    far.camera.projection = Projection::kPerspective;
    far.camera.fov = 1e-13;
    EXPECT_NO_THROW((void)renderVolume(volume, far)) << times;
  }
}

TEST(RenderVolume, AgreesFromInside) {
  const auto volume = scattered();
  const CameraWish inside{.eye = Vec3{9, 10, 11}, .center = Vec3{40, 12, 20}, .fov = 90.0};
  EXPECT_GE(brickAgreement(volume, optionsFor(volume, inside)), kAskedOfBricks);
}

TEST(RenderVolume, EmptySpaceIsTransparentWhateverItsOpacity) {
  auto volume = scattered();
  volume.background = 0.0f;
  RenderOptions o = optionsFor(volume);
  o.transfer.opacity = builtInOpacity("inverse");
  o.opacityLength = o.step;  // 1 - (1 - opacity)^0.1 is too steep at opacity 1 for a table
  EXPECT_GE(brickAgreement(volume, o), kAskedOfBricks);
  EXPECT_EQ(renderVolume(volume, o).rgba[3], 0.0f) << "a corner that no ray to the volume meets";
}

TEST(RenderVolume, IsTheSameForAnyNumberOfThreads) {
  const auto volume = scattered();
  const auto draw = [&] { return renderVolume(volume, optionsFor(volume)).rgba; };
  EXPECT_EQ(onThreads(1, draw), onThreads(3, draw));
}

TEST(RenderVolume, NoVoxelsGiveAnEmptyPicture) {
  expectTransparent(renderVolume(SparseVolume{}, optionsFor(scattered())));
}

TEST(Renderers, AgreeOnSmoothFields) {
  // For a blob with scale s, trilinear interpolation errs by up to 3/8 of the second derivative,
  // about 2 I / s^2. This is 0.7 % of the intensity for s = 10, and more for smaller scales. An
  // opacity of 1/20 reduces it, and most errors have the same sign, which gives 45 dB.
  const Field field =
      withoutNegatives(randomField({.count = 25, .smallest = 8.0, .aspect = 1.5, .kappa = 0.0f}));
  const SparseVolume volume = revoxelise(field, {.threshold = -1.0f});
  RenderOptions o = optionsFor(volume);
  o.transfer = rescaled(o.transfer, {0.0f, 5.0f});
  o.opacityLength = 20.0;
  o.between = Between::kSum;
  EXPECT_GE(imagePsnr(renderField(field, o), renderVolume(volume, o)), 45.0);
}

}  // namespace
}  // namespace esvr::test
