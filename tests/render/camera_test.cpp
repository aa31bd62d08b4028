// Plan: a fitted camera shows every corner of the box; projections are compared with values
// computed by hand.
#include "esvr/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "render/view.h"

namespace esvr::test {
namespace {

constexpr Box kBox{{-10, 0, 5}, {30, 60, 25}};
constexpr double kExact = 1e-9;

/// The position of a point in the picture, from -1 to 1 in each direction.
std::array<double, 2> placeInPicture(const View& view, Resolution resolution, const Vec3& place) {
  Vec3 c = view.coordinates(difference(place, view.eye));
  const double depth = view.perspective ? c[2] : 1.0;
  return {2 * c[0] / depth / (view.pixel * resolution.width),
          2 * c[1] / depth / (view.pixel * resolution.height)};
}

void expectSeen(const Camera& camera, Resolution resolution) {
  const View view(camera, resolution);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 place{double(corner & 1 ? kBox.min.x : kBox.max.x),
                     double(corner & 2 ? kBox.min.y : kBox.max.y),
                     double(corner & 4 ? kBox.min.z : kBox.max.z)};
    const auto [x, y] = placeInPicture(view, resolution, place);
    EXPECT_LT(std::abs(x), 1.0);
    EXPECT_LT(std::abs(y), 1.0);
  }
}

TEST(Camera, FittedShowsTheWholeBox) {
  for (const Resolution r : {Resolution{800, 800}, Resolution{1600, 400}, Resolution{100, 700}})
    for (const auto projection : {Projection::kPerspective, Projection::kOrthographic})
      for (const double fov : {5.0, 30.0, 100.0}) {
        CameraWish wish{.projection = projection};
        wish.fov = fov;
        const Camera camera = fitCamera(kBox, wish, r);
        EXPECT_NO_THROW(checkCamera(camera, r));
        expectSeen(camera, r);
      }
}

TEST(Camera, WhatIsGivenIsKept) {
  const CameraWish wish{
      .eye = Vec3{1, 2, 3}, .center = Vec3{4, 5, 6}, .up = Vec3{1, 0, 0}, .fov = 12.0};
  const Camera camera = fitCamera(kBox, wish, {});
  EXPECT_EQ(camera.eye, *wish.eye);
  EXPECT_EQ(camera.center, *wish.center);
  EXPECT_EQ(camera.up, *wish.up);
  EXPECT_EQ(camera.fov, 12.0);
}

TEST(Camera, LookingAlongYHasZUpwards) {
  const Camera camera =
      fitCamera(kBox, {.eye = Vec3{0, 100, 0}, .center = Vec3{0, 0, 0}}, Resolution{});
  EXPECT_EQ(camera.up, (Vec3{0, 0, 1}));
}

TEST(Camera, TurnsAboutItsUpAxis) {
  const Camera camera = fitCamera(kBox, {.eye = Vec3{10, 7, 50}, .center = Vec3{10, 5, 20}}, {});
  const Camera quarter = turned(camera, 90.0);
  EXPECT_NEAR(quarter.eye[0], 40.0, kExact);
  EXPECT_NEAR(quarter.eye[1], 7.0, kExact);
  EXPECT_NEAR(quarter.eye[2], 20.0, kExact);
  const Camera once = turned(camera, 360.0);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(once.eye[a], camera.eye[a], kExact);
}

TEST(View, TheMiddlePixelLooksAtTheCenter) {
  const Camera camera = fitCamera(kBox, {}, {3, 3});
  const View view(camera, {3, 3});
  const Ray ray = view.ray(1, 1);
  const Vec3 expected = unit(difference(camera.center, camera.eye));
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(ray.direction[a], expected[a], kExact);
}

TEST(View, RowsRunDownwardsAndColumnsToTheRight) {
  const Camera camera{.eye = {0, 0, 10}, .center = {0, 0, 0}, .up = {0, 1, 0}};
  const View view(camera, {4, 4});
  EXPECT_LT(view.ray(0, 0).direction[0], 0.0);
  EXPECT_GT(view.ray(0, 0).direction[1], 0.0);
  EXPECT_GT(view.ray(3, 3).direction[0], 0.0);
  EXPECT_LT(view.ray(3, 3).direction[1], 0.0);
}

TEST(Camera, WhatMakesNoSenseIsRefused) {
  const Camera good = fitCamera(kBox, {}, {});
  const auto refused = [&](auto&& spoil, Resolution resolution = {}) {
    Camera c = good;
    spoil(c);
    EXPECT_THROW(checkCamera(c, resolution), UsageError);
  };
  refused([](Camera& c) { c.eye = c.center; });
  refused([](Camera& c) { c.up = {0, 0, 0}; });
  refused([](Camera& c) { c.up = difference(c.eye, c.center); });
  refused([](Camera& c) { c.fov = 180.0; });
  refused([](Camera& c) { c.fov = 0.0; });
  refused([](Camera& c) { c.height = -1.0; });
  refused([](Camera& c) { c.eye[1] = std::numeric_limits<double>::infinity(); });
  refused([](Camera&) {}, {0, 10});
  // The renderers store the numbers of pixels in 16 bits.
  refused([](Camera&) {}, {32768, 10});
  refused([](Camera&) {}, {10, 100'000});
  EXPECT_NO_THROW(checkCamera(good, {Resolution::kMaxSide, 1}));
}

}  // namespace
}  // namespace esvr::test
