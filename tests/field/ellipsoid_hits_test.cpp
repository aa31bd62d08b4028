// Plan: the average number of ellipsoids that reach a voxel, over the voxels that any reaches,
// agrees with a count by the definition in float64, for shared kernels and kernels of each
// ellipsoid.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esvr/field.h"
#include "field/line_form.h"
#include "field/random_field.h"

namespace esvr {
namespace {

struct Shape {
  std::array<double, 3> center;
  Matrix3 L;
  double cutoff;
};

std::vector<Shape> shapesOf(const Field& field) {
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  std::vector<Shape> shapes;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const double kappa = e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
    shapes.push_back({{e.center[0][i], e.center[1][i], e.center[2][i]},
                      unitFrame(e, i),
                      kernelConstants<double>(field.kernel, kappa).cutoff});
  }
  return shapes;
}

bool holds(const Shape& s, Coord v) {
  const double d[3] = {v.x - s.center[0], v.y - s.center[1], v.z - s.center[2]};
  double m = 0.0;
  for (std::size_t r = 0; r < 3; ++r)
    m += std::pow(s.L[3 * r] * d[0] + s.L[3 * r + 1] * d[1] + s.L[3 * r + 2] * d[2], 2);
  return m < s.cutoff;
}

double countedOverAll(const Field& field) {
  constexpr int kMargin = 14, kExtent = 20;  // longer than the longest support
  const auto shapes = shapesOf(field);
  double hits = 0.0, voxels = 0.0;
  for (int x = -kMargin; x < kExtent + kMargin; ++x)
    for (int y = -kMargin; y < kExtent + kMargin; ++y)
      for (int z = -kMargin; z < kExtent + kMargin; ++z) {
        const auto here = std::count_if(shapes.begin(), shapes.end(), [&](const Shape& s) {
          return holds(s, {x, y, z});
        });
        hits += double(here);
        voxels += here > 0 ? 1.0 : 0.0;
      }
  return hits / voxels;
}

// Float32 may put a voxel on the other side of a support's border: about one voxel in ten thousand.
TEST(AverageHits, AreThoseOfACountOverEveryVoxel) {
  Field field = test::randomField({.count = 30, .extent = 20, .smallest = 0.7, .aspect = 4.0});
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
  field.kernel = {KernelForm::kPaper, 5.0f, Kernel::kDefaultEpsilon};
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
  for (std::size_t i = 0; i < 30; ++i)
    field.chunks[0].ellipsoids.kappa.push_back(float(i) * 0.5f + 0.5f);
  EXPECT_NEAR(averageHits(field), countedOverAll(field), 1e-3);
}

TEST(AverageHits, OfNothingAreNone) { EXPECT_EQ(averageHits(Field{}), 0.0); }

}  // namespace
}  // namespace esvr
