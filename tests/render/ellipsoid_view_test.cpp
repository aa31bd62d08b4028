// Plan: the bounds of an ellipsoid in the picture are compared with the pixels whose rays meet the
// support, which are found in float64 from the rays. No such pixel may lie outside. For round
// ellipsoids of ten pixels the bounds are exact to a pixel, because the outline moves inward by
// only 0.5^2 / (2 * 10) pixels between two rows.
#include "render/ellipsoid_view.h"

#include <gtest/gtest.h>

#include "field/line_form.h"
#include "field/random_field.h"

namespace esvr::test {
namespace {

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
  return fitCamera({{0, 0, 0}, {39, 39, 39}}, wish, kPicture);
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

}  // namespace
}  // namespace esvr::test
