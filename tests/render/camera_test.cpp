// Plan: the corners of boxes of several shapes are projected by fitted cameras. Their extent in the
// picture must be the share that fitCamera promises, which the tests compute in float64 with an
// error of about 1e-15 times the ratio of a coordinate to the size of the box. Other projections
// are compared with values computed by hand.
#include "esvr/camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "render/view.h"
#include "support/messages.h"

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

/// The smallest and the largest position of a box in the picture.
struct Extent {
  std::array<double, 2> low{2.0, 2.0}, high{-2.0, -2.0};

  void include(const std::array<double, 2>& place) {
    for (int a = 0; a < 2; ++a) {
      low[a] = std::min(low[a], place[a]);
      high[a] = std::max(high[a], place[a]);
    }
  }
  /// The share of the picture's width or height, whichever is larger.
  [[nodiscard]] double share() const { return std::max(high[0] - low[0], high[1] - low[1]) / 2; }
  [[nodiscard]] double farthest() const { return std::max({-low[0], -low[1], high[0], high[1]}); }
};

/// The extent of a box that reaches to the next voxels.
Extent extentOf(const Box& box, const Camera& camera, Resolution resolution) {
  const View view(camera, resolution);
  Extent extent;
  for (unsigned corner = 0; corner < 8; ++corner)
    extent.include(placeInPicture(view, resolution,
                                  {corner & 1u ? box.min.x - 1.0 : box.max.x + 1.0,
                                   corner & 2u ? box.min.y - 1.0 : box.max.y + 1.0,
                                   corner & 4u ? box.min.z - 1.0 : box.max.z + 1.0}));
  return extent;
}

/// The extent over many pictures of a turn.
Extent extentOfTurn(const Box& box, const CameraWish& wish, Resolution resolution) {
  const Camera camera = fitCamera(box, wish, resolution);
  constexpr int kSteps = 720;
  Extent all;
  for (int step = 0; step < kSteps; ++step) {
    const Extent one =
        extentOf(box, turned(camera, 360.0 * step / kSteps, pivotOf(box, wish)), resolution);
    all.include(one.low);
    all.include(one.high);
  }
  return all;
}

constexpr int kFar = 10'000'000;
/// A cube, a slab, a rod, a voxel, and volumes far from the origin.
constexpr std::array kBoxes{kBox,
                            Box{{0, 0, 0}, {63, 63, 63}},
                            Box{{0, 0, 0}, {499, 2, 499}},
                            Box{{0, 0, 0}, {499, 499, 0}},
                            Box{{-3, 0, 5}, {-2, 2000, 6}},
                            Box{{7, 8, 9}, {7, 8, 9}},
                            Box{{kFar, kFar, -kFar}, {kFar + 90, kFar + 20, 50 - kFar}},
                            Box{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}},
                            Box{{kFar, kFar, kFar}, {kFar, kFar, kFar}}};
constexpr std::array kResolutions{Resolution{800, 800}, Resolution{1600, 400},
                                  Resolution{100, 700}};
/// Directions from the camera to the volume, as differences of the center and the eye.
constexpr std::array kDirections{Vec3{0, 0, -1}, Vec3{-1, 0, 0}, Vec3{0, -1, 0}, Vec3{-1, -2, 3},
                                 Vec3{0.3, 2, -0.1}};

/// A double at 1e7 is exact to 2e-9; the smallest box has a size of 2.
constexpr double kRounding = 1e-7;

/// Calls a function with each box, picture and projection.
template <class Function>
void forEachCamera(const Function& check) {
  for (const Box& box : kBoxes)
    for (const Resolution r : kResolutions)
      for (const double fov : {5.0, 30.0, 100.0, 0.0}) {
        SCOPED_TRACE(toString(box.max) + ", " + std::to_string(r.width) + ", " +
                     std::to_string(fov));
        CameraWish wish;
        if (fov > 0.0)
          wish.fov = fov;
        else
          wish.projection = Projection::kOrthographic;
        check(box, wish, r);
      }
}

TEST(Camera, FittedFillsNineTenthsOfThePicture) {
  forEachCamera([](const Box& box, const CameraWish& wish, Resolution r) {
    const Camera camera = fitCamera(box, wish, r);
    EXPECT_NO_THROW(checkCamera(camera, r));
    const Extent extent = extentOf(box, camera, r);
    EXPECT_NEAR(extent.share(), kFilledShare, kRounding);
    EXPECT_NEAR(extent.farthest(), kFilledShare, kRounding) << "is in the middle";
  });
}

TEST(Camera, FittedToAPlaceFillsThePictureUpToTheFarthestCorner) {
  forEachCamera([](const Box& box, CameraWish wish, Resolution r) {
    wish.center = Vec3{double(box.min.x), double(box.max.y), double(box.min.z)};
    const Camera camera = fitCamera(box, wish, r);
    EXPECT_EQ(camera.center, *wish.center);
    EXPECT_NEAR(extentOf(box, camera, r).farthest(), kFilledShare, kRounding);
  });
}

TEST(Camera, OrthographicFillsNineTenthsFromEveryDirection) {
  for (const Box& box : kBoxes)
    for (const Resolution r : kResolutions)
      for (const Vec3& direction : kDirections) {
        const Vec3 eye =
            difference({(double(box.min.x) + box.max.x) / 2, (double(box.min.y) + box.max.y) / 2,
                        (double(box.min.z) + box.max.z) / 2},
                       scaled(direction, 4.0 * kFar));
        const Camera camera =
            fitCamera(box, {.eye = eye, .projection = Projection::kOrthographic}, r);
        EXPECT_EQ(camera.eye, eye);
        EXPECT_NEAR(extentOf(box, camera, r).share(), kFilledShare, kRounding);
      }
}

TEST(Camera, AnyUpDirectionFillsNineTenths) {
  for (const Vec3& up : kDirections)
    for (const Resolution r : kResolutions)
      EXPECT_NEAR(extentOf(kBox, fitCamera(kBox, {.up = up}, r), r).share(), kFilledShare, kExact);
}

TEST(Camera, NoPictureOfATurnExceedsNineTenths) {
  // The largest extent lies between two of the 720 pictures, which differ by 1 - cos(0.25 degrees),
  // times 10 for a wide field of view.
  constexpr double kBetweenPictures = 1e-4;
  forEachCamera([&](const Box& box, CameraWish wish, Resolution r) {
    wish.framing = Framing::kTurn;
    const Extent extent = extentOfTurn(box, wish, r);
    EXPECT_LE(extent.farthest(), kFilledShare + kRounding);
    EXPECT_GE(extent.share(), kFilledShare - kBetweenPictures);
  });
}

TEST(Camera, ATurnAboutATiltedAxisStaysInThePicture) {
  for (const Vec3& up : kDirections) {
    const Extent extent = extentOfTurn(kBox, {.up = up, .framing = Framing::kTurn}, {});
    EXPECT_LE(extent.farthest(), kFilledShare + kExact);
  }
}

TEST(Camera, TheRightEdgeStaysFreeWhereAsked) {
  // The middle of the part for the box is at -kFree, and its width is a share of 1 - kFree.
  constexpr double kFree = 0.2;
  constexpr double kHigh = kFilledShare * (1 - kFree) - kFree;
  constexpr double kLow = -kFilledShare * (1 - kFree) - kFree;
  forEachCamera([&](const Box& box, CameraWish wish, Resolution r) {
    wish.freeRight = kFree;
    const Extent still = extentOf(box, fitCamera(box, wish, r), r);
    EXPECT_LE(still.high[0], kHigh + kRounding);
    EXPECT_GE(still.low[0], kLow - kRounding);
    const double tightest = std::max((still.high[0] - still.low[0]) / (kHigh - kLow),
                                     (still.high[1] - still.low[1]) / (2 * kFilledShare));
    EXPECT_NEAR(tightest, 1.0, kRounding);
    wish.framing = Framing::kTurn;
    const Extent turning = extentOfTurn(box, wish, r);
    EXPECT_LE(turning.high[0], kHigh + kRounding);
    EXPECT_GE(turning.low[0], kLow - kRounding);
  });
}

TEST(Camera, ASphereHasTheSameSizeFromEveryDirection) {
  const Camera camera = fitCamera(kBox, {.framing = Framing::kSphere}, {});
  EXPECT_EQ(camera.center, (Vec3{10, 30, 15}));
  const double radius = length({41, 61, 21}) / 2;
  EXPECT_NEAR(length(difference(camera.eye, camera.center)), radius / std::sin(radians(15)),
              kExact);
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
  const Camera half = turned(camera, 180.0, {0, 0, 0});
  const Vec3 eye{-10, 7, -50}, center{-10, 5, -20};
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(half.eye[a], eye[a], kExact);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(half.center[a], center[a], kExact);
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

// Its place would not be finite, and be named instead of the field of view.
TEST(Camera, IsNotFittedToAFieldOfViewThatMakesNoSense) {
  for (const double fov : {0.0, -5.0, 180.0, std::nan("")}) {
    const auto fitted = [&] { (void)fitCamera(kBox, {.fov = fov}, {}); };
    EXPECT_THAT(fitted, ThrowsSaying<UsageError>("field of view"));
  }
}

}  // namespace
}  // namespace esvr::test
