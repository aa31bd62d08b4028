// Plan: a residual keeps every voxel within the bound, by value and with the mask, whatever the
// sum is like and as far off as another machine's rounding may take it.

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
      const auto grid = withResidual(makeStoredGrid({}, tube, field, activity), tube, bound);
      ASSERT_TRUE(grid);
      const SparseVolume back = decodeGrid(throughTheFile(*grid));
      EXPECT_LE(largestDifference(tube, back), bound);
      if (activity == Activity::kExact) {
        EXPECT_EQ(back.active, tube.active);
        EXPECT_EQ(back.bricks, tube.bricks);
      }
    }
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

/// Intensities a few units in the last place off move the sum as another evaluation would.
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

/// What is smooth is worth its ellipsoids, noise is not.
TEST(FitWithin, SlowTakesEllipsoidsWhereTheyPay) {
  FitOptions options;
  options.iterations = 200;
  options.kappa = 0.0f;
  const GridDescriptor descriptor;
  const auto bytesOf = [](const StoredGrid& grid) {
    return encodeEsvr({{}, {grid}}).size() - encodeEsvr({}).size();
  };
  test::Random random(5);
  std::array<std::array<double, 4>, 16> blobs;  // center, width
  for (auto& [x, y, z, width] : blobs)
    x = random(5, 43), y = random(5, 43), z = random(5, 43), width = random(3, 6);
  const SparseVolume smooth = test::volumeOf({}, 6, 0.0f, [&](Coord v) {
    double sum = 0.0;
    for (const auto& [x, y, z, width] : blobs)
      sum += std::exp(-((v.x - x) * (v.x - x) + (v.y - y) * (v.y - y) + (v.z - z) * (v.z - z)) /
                      (2.0 * width * width));
    return float(sum);
  });
  const SparseVolume noise =
      test::volumeOf({}, 2, 0.0f, [&](Coord) { return float(random(0.5, 1.0)); });
  for (const SparseVolume* volume : {&smooth, &noise}) {
    const StoredGrid voxels =
        makeStoredVoxels(descriptor, *volume, boundedLayer(*volume, 0.1, Activity::kByValue));
    const BoundedFit fitted =
        fitWithin({descriptor, *volume, options, Activity::kByValue}, 0.1, bytesOf(voxels));
    EXPECT_EQ(fitted.rated.has_value(), volume == &smooth)
        << fitted.bytes << " bytes against " << bytesOf(voxels);
    if (!fitted.rated) continue;
    EXPECT_EQ(bytesOf(fitted.rated->grid), fitted.bytes);
    EXPECT_LT(fitted.bytes, bytesOf(voxels));
    EXPECT_LE(largestDifference(*volume, decodeGrid(fitted.rated->grid)), 0.1);
  }
}

}  // namespace
}  // namespace esvr
