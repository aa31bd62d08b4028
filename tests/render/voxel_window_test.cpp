// Plan: the window contains all voxels that the samples of a rectangle's rays lie between, which
// are found for each sample in float64 from its ray. Interpolation in a window gives back a linear
// function, to float32 precision. Windows for one sample of one ray have few voxels for every
// direction.
#include "render/voxel_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace esvr::test {
namespace {

constexpr Resolution kPicture{64, 48};
constexpr WindowLimits kAny{.slabs = 4096, .voxels = 1 << 24};

View viewFrom(const Vec3& eye, const Vec3& up, double fov, Projection projection) {
  const bool flat = projection == Projection::kOrthographic;
  CameraWish wish{.eye = eye, .center = Vec3{1.5, -2.25, 3.0}, .up = up, .projection = projection};
  if (!flat) wish.fov = fov;
  return {fitCamera({{-20, -20, -20}, {20, 20, 20}}, wish, kPicture), kPicture};
}

struct Samples {
  PixelRectangle pixels;
  double first;
  int count;
  double step;
};

struct Laid {
  RayBundle bundle;
  VoxelWindow window;
  WindowOrigin origin;
  std::vector<WindowSlab> slabs;
};

bool layOut(const View& view, const Samples& s, Laid& laid) {
  laid.bundle = bundleOf(view, s.pixels);
  const DepthRange depths = depthsOf(laid.bundle, s.first, s.first + s.count - 1, s.step);
  if (!windowFor(laid.bundle, depths, kAny, laid.window)) return false;
  laid.origin = originOf(laid.bundle, laid.window);
  for (int i = 0; i < laid.window.slabs; ++i)
    laid.slabs.push_back(slabOf(laid.bundle, laid.window, laid.origin, i));
  return true;
}

WindowPlace placeIn(const Laid& laid, const Vec3& p) {
  const WindowAxes& axes = laid.window.axes;
  return {float(p[axes.slab] - laid.origin.slab), float(p[axes.row] - laid.origin.row),
          float(p[axes.column] - laid.origin.column)};
}

bool holdsCell(const Laid& laid, const WindowPlace& p) {
  const int slab = int(std::floor(p.slab));
  if (slab < 0 || slab + 1 >= laid.window.slabs) return false;
  for (int s = slab; s <= slab + 1; ++s) {
    const int row = int(std::floor(p.row)) - laid.slabs[std::size_t(s)].row;
    const int column = int(std::floor(p.column)) - laid.slabs[std::size_t(s)].column;
    if (row < 0 || row + 1 >= laid.window.rows || column < 0 || column + 1 >= laid.window.columns)
      return false;
  }
  return true;
}

double linear(double slab, double row, double column) {
  return 0.5 + 0.25 * slab - 0.125 * row + 0.0625 * column;
}

std::vector<float> linearValues(const Laid& laid) {
  std::vector<float> values(std::size_t(laid.window.voxels()), 1e9f);
  for (int s = 0; s < laid.window.slabs; ++s)
    for (int r = 0; r < laid.window.rows; ++r)
      for (int c = 0; c < laid.window.columns; ++c) {
        const WindowSlab& at = laid.slabs[std::size_t(s)];
        const int row = at.row + r, column = at.column + c;
        values.at(std::size_t(at.start + row * laid.window.columns + column)) =
            float(linear(s, row, column));
      }
  return values;
}

void expectAllSamplesInside(const View& view, const Samples& s) {
  Laid laid;
  if (!layOut(view, s, laid)) {
    EXPECT_FALSE(laid.bundle.together) << "only rays of too different directions have no window";
    return;
  }
  const auto values = linearValues(laid);
  for (int row = s.pixels.firstRow; row <= s.pixels.lastRow; ++row)
    for (int column = s.pixels.firstColumn; column <= s.pixels.lastColumn; ++column) {
      const Ray ray = view.ray(column, row);
      for (int i = 0; i < s.count; ++i) {
        const Vec3 place = sum(ray.origin, scaled(ray.direction, (s.first + i) * s.step));
        const WindowPlace p = placeIn(laid, place);
        ASSERT_TRUE(holdsCell(laid, p)) << column << " " << row << " " << i;
        ASSERT_NEAR(interpolate(values.data(), laid.slabs.data(), laid.window.columns, p),
                    linear(p.slab, p.row, p.column), 1e-4);
      }
    }
}

constexpr PixelRectangle kRectangles[] = {
    {0, 7, 0, 7}, {24, 31, 16, 23}, {56, 63, 40, 47}, {13, 13, 9, 9}, {0, 15, 0, 11}};

TEST(VoxelWindow, HoldsTheCellsOfAllSamples) {
  const Vec3 eyes[] = {{60, 5, 4}, {-40, 60, 3}, {3, -70, 50}, {30, 31, -32}, {2, 3, 90}};
  for (const Vec3& eye : eyes)
    for (const auto projection : {Projection::kPerspective, Projection::kOrthographic})
      for (const PixelRectangle& pixels : kRectangles)
        for (const double step : {0.1, 1.0, 9.0})
          expectAllSamplesInside(viewFrom(eye, {0.1, 1, 0.2}, 50.0, projection),
                                 {pixels, 13.0, 32, step});
}

TEST(VoxelWindow, HoldsTheCellsOfACameraBetweenVoxels) {
  for (const double fov : {20.0, 120.0, 170.0})
    for (const PixelRectangle& pixels : kRectangles)
      expectAllSamplesInside(viewFrom({0.3, 0.4, -0.6}, {0, 1, 0}, fov, Projection::kPerspective),
                             {pixels, 0.0, 32, 1.0});
}

TEST(VoxelWindow, IsSmallForARayAlone) {
  const Vec3 eyes[] = {{60, 5, 4}, {-40, 60, 3}, {30, 31, -32}};
  for (const Vec3& eye : eyes) {
    Laid laid;
    ASSERT_TRUE(layOut(viewFrom(eye, {0.1, 1, 0.2}, 170.0, Projection::kPerspective),
                       {{63, 63, 0, 0}, 50.0, 1, 1.0}, laid));
    EXPECT_LE(laid.window.voxels(), 75);
  }
}

TEST(VoxelWindow, IsRefusedWhereItIsTooLarge) {
  const View view = viewFrom({60, 5, 4}, {0, 1, 0}, 50.0, Projection::kPerspective);
  const RayBundle b = bundleOf(view, {0, 7, 0, 7});
  VoxelWindow w{};
  EXPECT_FALSE(windowFor(b, depthsOf(b, 0, 31, 1.0), {.slabs = 8, .voxels = 1 << 20}, w));
  EXPECT_FALSE(windowFor(b, depthsOf(b, 0, 31, 1.0), {.slabs = 4096, .voxels = 100}, w));
  EXPECT_TRUE(windowFor(b, depthsOf(b, 0, 31, 1.0), kAny, w));
}

}  // namespace
}  // namespace esvr::test
