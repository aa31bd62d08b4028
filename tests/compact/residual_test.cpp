// Plan: a residual gives every voxel of a narrow band the sign of its source, also for the rounding
// differences of another machine, and belongs to all of the ellipsoids.

#include "esvr/compact.h"

#include <gtest/gtest.h>

#include "../field/random_field.h"
#include "../fit/volumes.h"
#include "esvr/fit.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr {
namespace {

/// A level set that few ellipsoids restore badly.
StoredGrid roughBand(const SparseVolume& volume) {
  FitOptions options;
  options.count = 40;
  options.iterations = 40;
  options.kappa = 2.0f;
  options.narrowBand = true;
  GridDescriptor levelSet;
  levelSet.gridClass = GridClass::kLevelSet;
  levelSet.background = volume.background;
  return makeStoredGrid(levelSet, volume, fit(volume, options).field);
}

std::uint64_t wrongSigns(const SparseVolume& volume, const StoredGrid& grid) {
  const auto bytes = encodeEsvr({{}, {grid}});
  return compareSigns(volume, decodeGrid(decodeEsvr(bytes, "memory").grids[0])).voxels;
}

TEST(WithSigns, GivesEveryVoxelItsSign) {
  const SparseVolume volume = test::levelSetVolume();
  const StoredGrid rough = roughBand(volume), right = withSigns(rough, volume);
  EXPECT_GT(wrongSigns(volume, rough), 0u);
  ASSERT_TRUE(right.residual);
  EXPECT_EQ(wrongSigns(volume, right), 0u);
}

/// Changes of intensities in the last places move the sum as another machine's evaluation does.
TEST(WithSigns, HoldsForASumThatRoundsDifferently) {
  const SparseVolume volume = test::levelSetVolume();
  StoredGrid grid = withSigns(roughBand(volume), volume);
  test::Random random(3);
  for (float& intensity : grid.field.chunks[0].ellipsoids.intensity)
    intensity *= float(1.0 + random(-4e-6, 4e-6));
  EXPECT_EQ(wrongSigns(volume, grid), 0u);
}

TEST(WithSigns, BelongsToAllOfTheEllipsoids) {
  const SparseVolume volume = test::levelSetVolume();
  const StoredGrid grid = withSigns(roughBand(volume), volume);
  EXPECT_TRUE(heaviest(grid, 1000).residual);
  EXPECT_FALSE(heaviest(grid, 3).residual);
}

}  // namespace
}  // namespace esvr
