// Plan: m on a line, computed from a float32 line form, agrees with |L d|^2 in float64 at the
// voxels of bricks, for many scales, thin and flat ellipsoids and far centers. The value at the
// closest point must be a lower bound for the line in float32 too, because the CUDA kernel skips
// lines by it.

#include "field/line_form.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "esvr/volume.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using Vec3 = std::array<double, 3>;

float squaredByLine(const LineForm& f, Coord voxel) {
  const float dx = float(voxel.x) - f.center[0], dz = float(voxel.z) - f.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float closest = closestSquared(f, dx, pzDz);
  return squaredAt(f, closest, distanceAlong(f, float(voxel.y), f.center[1], dx, dz));
}

double squaredByDefinition(const Ellipsoids& e, std::size_t i, Coord voxel) {
  const Matrix3 L = unitFrame(e, i);
  const Vec3 d{voxel.x - double(e.center[0][i]), voxel.y - double(e.center[1][i]),
               voxel.z - double(e.center[2][i])};
  double m = 0.0;
  for (int r = 0; r < 3; ++r) {
    const double u = L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2];
    m += u * u;
  }
  return m;
}

LineForm lineForm(const Ellipsoids& e, std::size_t i) {
  constexpr double kRadius = 3.0;  // affects half widths only
  return makeLineForm({e.center[0][i], e.center[1][i], e.center[2][i]}, unitFrame(e, i), kRadius,
                      e.intensity[i]);
}

template <class Visit>
void forEachVoxel(int side, Visit&& visit) {
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) visit(Coord{x, y, z});
}

struct Shape {
  double smallest, aspect;
};
class LineMath : public testing::TestWithParam<Shape> {
 protected:
  static constexpr int kSide = 16;
  const Ellipsoids ellipsoids = test::randomField({.count = 40,
                                                   .extent = kSide,
                                                   .smallest = GetParam().smallest,
                                                   .aspect = GetParam().aspect})
                                    .chunks[0]
                                    .ellipsoids;
};

// The terms of u = px dx + pz dz and of t are up to |d| / s, with the smallest scale s, and may
// cancel down to |u|. Each has about five roundings of 2^-24 |d| / s. The error of m = |u|^2 is
// therefore 2 |u| times that, plus its square.
TEST_P(LineMath, IsTheSquaredDistanceUpToRounding) {
  const double perTerm = 5 * 0x1p-24 * std::sqrt(3.0) * kSide / GetParam().smallest;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const LineForm f = lineForm(ellipsoids, i);
    forEachVoxel(kSide, [&](Coord voxel) {
      const double m = squaredByDefinition(ellipsoids, i, voxel);
      const double bound = 2 * std::sqrt(m) * perTerm + perTerm * perTerm;
      ASSERT_NEAR(squaredByLine(f, voxel), m, bound) << toString(voxel) << ", ellipsoid " << i;
    });
  }
}

TEST_P(LineMath, IsNowhereBelowTheClosestApproach) {
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    const LineForm f = lineForm(ellipsoids, i);
    forEachVoxel(kSide, [&](Coord voxel) {
      const float dx = float(voxel.x) - f.center[0], dz = float(voxel.z) - f.center[2];
      const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
      ASSERT_GE(squaredByLine(f, voxel), closestSquared(f, dx, pzDz));
    });
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, LineMath,
                         testing::Values(Shape{1.0, 1.0}, Shape{0.5, 4.0}, Shape{0.05, 10.0},
                                         Shape{0.3, 100.0}, Shape{0.3, 1000.0}, Shape{1e3, 3.0}));

TEST(DistanceAlong, IsZeroAtTheClosestApproachAndGrowsByOneAVoxel) {
  const Ellipsoids e = test::randomField({.count = 1}).chunks[0].ellipsoids;
  const LineForm f = lineForm(e, 0);
  const float dx = 1.5f, dz = -2.0f, closestY = f.center[1] + f.sx * dx + f.sz * dz;
  EXPECT_NEAR(distanceAlong(f, closestY, f.center[1], dx, dz), 0.0f, 1e-5f);
  EXPECT_NEAR(distanceAlong(f, closestY + 1.0f, f.center[1], dx, dz), 1.0f, 1e-5f);
}

}  // namespace
}  // namespace esvr
