// Plan: a residual keeps every voxel within the bound, by value and with a mask, for any sum and
// for the rounding differences of another machine.

#include "esvr/residual.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "../field/random_field.h"
#include "../fit/volumes.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/level_of_detail.h"

namespace esvr {
namespace {

Field roughFit(const SparseVolume& volume) {
  FitOptions options;
  options.count = 40;
  options.iterations = 40;
  options.kappa = 2.0f;
  return fit(volume, options).field;
}

StoredGrid throughTheFile(const StoredGrid& grid) {
  const auto bytes = encodeEsvr({{}, {grid}});
  StoredGrid back = decodeEsvr(bytes, "memory").grids[0];
  EXPECT_EQ(encodeEsvr({{}, {back}}), bytes);
  return back;
}

TEST(WithResidual, KeepsEveryVoxelWithinTheBound) {
  const SparseVolume tube = test::tubeVolume();
  const Field field = roughFit(tube);
  for (const auto activity : {Activity::kByValue, Activity::kExact})
    for (const double bound : {0.3, 0.05, 0.01}) {
      const auto grid = withResidual(makeStoredGrid({}, tube, field, {activity}), tube, bound);
      ASSERT_TRUE(grid);
      const SparseVolume back = decodeGrid(throughTheFile(*grid));
      EXPECT_LE(largestDifference(tube, back), bound);
      if (activity == Activity::kExact) {
        EXPECT_EQ(back.active, tube.active);
        EXPECT_EQ(back.bricks, tube.bricks);
      }
    }
}

TEST(WithResidual, KeepsItsBoundAfterRoundingToHalfs) {
  SparseVolume tube = test::tubeVolume();
  roundToHalfs(tube);
  const Field field = roughFit(tube);
  GridDescriptor halfs;
  halfs.valueType = ValueType::kHalf;
  for (const auto activity : {Activity::kByValue, Activity::kExact})
    for (const double bound : {0.3, 0.05, 0.01, 0.002, 0.0012}) {
      const auto grid = withResidual(makeStoredGrid(halfs, tube, field, {activity}), tube, bound);
      if (!grid) continue;  // no room for the rounding
      EXPECT_LE(largestDifference(tube, decodeGrid(throughTheFile(*grid))), bound);
    }
  EXPECT_TRUE(withResidual(makeStoredGrid(halfs, tube, field), tube, 0.05));
}

TEST(WithResidual, IsSmallerTheMoreErrorIsAllowed) {
  const SparseVolume tube = test::tubeVolume();
  const StoredGrid grid = makeStoredGrid({}, tube, roughFit(tube));
  const auto bytes = [&](double bound) {
    return encodeEsvr({{}, {*withResidual(grid, tube, bound)}}).size();
  };
  EXPECT_LT(bytes(0.1), bytes(0.02));
  EXPECT_EQ(withResidual(grid, tube, 100.0)->residual->bricks.size(), 0u);
}

/// Changes of intensities in the last places move the sum as another machine's evaluation does.
TEST(WithResidual, HoldsForASumThatRoundsDifferently) {
  const SparseVolume tube = test::tubeVolume();
  const double bound = 0.01;
  StoredGrid grid = *withResidual(makeStoredGrid({}, tube, roughFit(tube)), tube, bound);
  test::Random random(3);
  for (float& intensity : grid.field.chunks[0].ellipsoids.intensity)
    intensity *= float(1.0 + random(-4e-6, 4e-6));
  EXPECT_LE(largestDifference(tube, decodeGrid(grid)), bound);
}

TEST(WithResidual, IsNotThereWhereRoundingTakesTheBound) {
  const SparseVolume tube = test::tubeVolume();
  EXPECT_FALSE(withResidual(makeStoredGrid({}, tube, roughFit(tube)), tube, 1e-5));
}

TEST(WithResidual, CountsOnABackgroundOtherThanZero) {
  SparseVolume tube = test::tubeVolume();
  tube.background = 2.0f;
  for (float& v : tube.values) v += 2.0f;
  const double bound = 0.02;
  const auto grid = withResidual(makeStoredGrid({}, tube, roughFit(tube)), tube, bound);
  ASSERT_TRUE(grid);
  EXPECT_LE(largestDifference(tube, decodeGrid(throughTheFile(*grid))), bound);
}

TEST(WithResidual, BelongsToAllOfTheEllipsoids) {
  const SparseVolume tube = test::tubeVolume();
  const auto grid = withResidual(makeStoredGrid({}, tube, roughFit(tube)), tube, 0.05);
  EXPECT_TRUE(heaviest(*grid, 1000).residual);
  EXPECT_FALSE(heaviest(*grid, 3).residual);
}

/// Ellipsoids with a residual are smaller than voxels for smooth data, but not for noise.
}  // namespace
}  // namespace esvr
