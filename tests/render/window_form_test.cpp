// Plan: the values that an ellipsoid adds to the voxels around it, row by row, agree with the
// definition in float64, for every order of the axes. At an aspect ratio of 10 the tolerance is
// 2e-5 of the intensity, for float32 products whose sum is at most the cutoff, 8. At 200 it is
// 2e-4, as for evaluateBricks. No voxel of the support may be missed, and slabs and rows end where
// the support ends.
#include "render/window_form.h"

#include <gtest/gtest.h>

#include <cmath>

#include "esvr/field.h"
#include "field/random_field.h"
#include "render/ellipsoid_view.h"
#include "render/window_scene.h"

namespace esvr::test {
namespace {

constexpr int kReach = 40;

Coord voxelAt(const WindowAxes& axes, int slab, int row, int column) {
  const auto of = [&](int axis) {
    return axis == axes.slab ? slab : (axis == axes.row ? row : column);
  };
  return {of(0), of(1), of(2)};
}

/// The values of a row from 0 to kReach - 1, computed by the runs.
std::vector<double> rowOf(const WindowForm& f, int axis, int slab, int row) {
  const WindowAxes axes = axesOfSlabs(axis);
  std::vector<double> values(kReach, 0.0);
  const WindowRun run = runOn(f.kernel, f.order[axis],
                              {float(slab) - f.center[axes.slab], float(row) - f.center[axes.row],
                               f.center[axes.column], 0, kReach - 1});
  for (int c = run.first; c <= run.last; ++c) values.at(std::size_t(c)) = valueAt(f.kernel, run, c);
  return values;
}

void expectTheDefinition(const Field& field, int axis, double tolerance) {
  const WindowForm f = windowForms(field).at(0);
  const WindowAxes axes = axesOfSlabs(axis);
  for (int slab = 0; slab < kReach; ++slab)
    for (int row = 0; row < kReach; ++row) {
      const auto values = rowOf(f, axis, slab, row);
      for (int c = 0; c < kReach; ++c) {
        const double expected = evaluateReference(field, voxelAt(axes, slab, row, c));
        ASSERT_NEAR(values[std::size_t(c)], expected, tolerance * f.kernel.bound);
        if (std::abs(expected) < tolerance * f.kernel.bound) continue;
        EXPECT_LE(std::abs(float(slab) - f.center[axes.slab]), f.order[axis].slabs);
        const WindowExtent rows =
            rowsOf(f.kernel, f.order[axis], float(slab) - f.center[axes.slab]);
        EXPECT_LE(rows.low, float(row) - f.center[axes.row]);
        EXPECT_GE(rows.high, float(row) - f.center[axes.row]);
      }
    }
}

Field one(double smallest, double aspect, std::uint32_t seed) {
  Field field = randomField({.count = 1, .smallest = smallest, .aspect = aspect, .seed = seed});
  for (auto& center : field.chunks[0].ellipsoids.center) center[0] = 17.3f + 0.1f * float(seed);
  return field;
}

TEST(WindowForm, AddsWhatTheDefinitionHasAtVoxels) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed)
    for (int axis = 0; axis < 3; ++axis) {
      expectTheDefinition(one(0.2, 5.0, seed), axis, 2e-5);
      expectTheDefinition(one(1.5, 10.0, seed), axis, 2e-5);
      expectTheDefinition(one(0.1, 200.0, seed), axis, 2e-4);
    }
}

TEST(WindowForm, TakesEachAxisOnce) {
  for (int slab = 0; slab < 3; ++slab) {
    const WindowAxes axes = axesOfSlabs(slab);
    EXPECT_EQ(axes.slab, slab);
    EXPECT_EQ((1 << axes.slab) | (1 << axes.row) | (1 << axes.column), 7);
  }
}

}  // namespace
}  // namespace esvr::test
