// Plan: errors are counted in the box and at the active voxels. Voxels are sampled in proportion to the squared residual of the allowed signs only. The
// center, the covariance and the height of a seed follow from the residual around it. In the
// Gaussian limit the kernel's moments have closed forms; a harder kernel is wider.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fit/cpu/residual.h"

namespace esvr {
namespace {

struct Bricks {
  BrickIndex index;
  std::vector<float> values;
  explicit Bricks(std::vector<Coord> bricks)
      : index(bricks), values(bricks.size() * kBrickVoxels) {}
  [[nodiscard]] ResidualField field() const { return {index, values}; }
};

TEST(DrawVoxels, FollowsTheEnergyBrickByBrick) {
  Bricks b({{0, 0, 0}, {1, 0, 0}});
  for (std::size_t v = 0; v < kBrickVoxels; ++v)
    b.values[v] = -1.0f, b.values[kBrickVoxels + v] = -2.0f;
  const auto voxels = sampleVoxels(b.field(), {.count = 100, .targetBricks = 2}).voxels;
  ASSERT_EQ(voxels.size(), 100u);
  const auto inSecond =
      std::count_if(voxels.begin(), voxels.end(), [](Coord v) { return v.x >= 8; });
  EXPECT_NEAR(double(inSecond), 80.0, 1.0);  // systematic sampling errs by at most one
}

TEST(DrawVoxels, LeavesAloneWhatItsSignCannotMend) {
  Bricks b({{0, 0, 0}});
  b.values[10] = 5.0f;   // V is too high
  b.values[20] = -1.0f;  // V is too low
  for (const Coord v : sampleVoxels(b.field(), {.count = 50, .targetBricks = 1}).voxels)
    EXPECT_EQ(v, voxelLocal(20));
  SamplingOptions negative{
      .count = 50, .targetBricks = 1, .signs = {.positive = false, .negative = true}};
  for (const Coord v : sampleVoxels(b.field(), negative).voxels) EXPECT_EQ(v, voxelLocal(10));
}

TEST(DrawVoxels, AVoxelOfManySharesIsDrawnOnce) {
  Bricks b({{0, 0, 0}});
  b.values[30] = -10.0f;
  b.values[40] = -0.1f;
  const auto [voxels, share] = sampleVoxels(b.field(), {.count = 1000, .targetBricks = 1});
  EXPECT_EQ(voxels, (std::vector<Coord>{voxelLocal(30)}));
  EXPECT_NEAR(share, 100.01 / 1000, 1e-6);
}

TEST(DrawVoxels, FindsNothingWhereThereIsNoError) {
  const Bricks b({{0, 0, 0}});
  EXPECT_TRUE(sampleVoxels(b.field(), {.count = 5, .targetBricks = 1}).voxels.empty());
}

// The first brick crosses the border of the box, the second is outside the target.
TEST(Errors, AreThoseOfEachVoxel) {
  Bricks b({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  for (std::size_t v = 0; v < b.values.size(); ++v) b.values[v] = float(int(v * 7919 % 1001) - 500);
  std::vector<BrickMask> active(2);
  for (int v = 0; v < kBrickVoxels; v += 3) active[0].set(v);
  active[1].setAll();
  FitTarget target;
  target.bricks = {{0, 0, 0}, {1, 0, 0}};
  target.active = &active;
  target.box = {{2, 0, 0}, {15, 7, 7}};
  const FitErrors errors = errorsOf(target, b.field());
  FitErrors expected;
  for (std::size_t i = 0; i < 3; ++i)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double r = double(b.values[i * kBrickVoxels + std::size_t(v)]);
      expected.squaredSum += r * r;
      if (target.box.contains(b.index.bricks()[i] * kBrickSide + voxelLocal(v)))
        expected.squaredSumBox += r * r;
      if (i < 2 && active[i].test(v)) expected.squaredSumActive += r * r;
      expected.largest = std::max(expected.largest, std::abs(r));
    }
  EXPECT_EQ(errors.squaredSum, expected.squaredSum);  // sums of integers are exact
  EXPECT_EQ(errors.squaredSumBox, expected.squaredSumBox);
  EXPECT_EQ(errors.squaredSumActive, expected.squaredSumActive);
  EXPECT_EQ(errors.largest, expected.largest);
}

TEST(Seed, TakesPlaceAndHeightFromTheResidual) {
  Bricks b({{0, 0, 0}, {0, 0, 1}});
  // A bar along z across two bricks, three voxels long and symmetric about (4, 4, 7).
  for (int z = 6; z <= 8; ++z)
    b.values[std::size_t((z >> 3) * kBrickVoxels + voxelOffset({4, 4, z & 7}))] = -0.5f;
  SeedOptions options;
  options.draw = {.count = 3, .targetBricks = 2};
  const auto seeds = seedsFromResidual(b.field(), options);
  ASSERT_EQ(seeds.size(), 3u);
  EXPECT_NEAR(seeds[1].center[0], 4.0, 1e-9);
  EXPECT_NEAR(seeds[1].center[2], 7.0, 1e-9);
  // All three seeds have the same residual and share it.
  EXPECT_NEAR(seeds[0].intensity + seeds[1].intensity + seeds[2].intensity, 0.5, 1e-7);
  const PrincipalAxes axes = principalAxes(seeds[1].L);
  EXPECT_GT(axes.scale[0], 1.4 * axes.scale[1]);  // longer along the bar
}

KernelMoments momentsOf(const Kernel& kernel) {
  return kernelMoments(kernelConstants<double>(kernel));
}

TEST(KernelMoments, AreThoseOfTheGaussian) {
  // e^-m has the mass pi^(3/2) and the variance 1/2 along each axis; what eps cuts off goes to zero
  // with it.
  const KernelMoments moments = momentsOf({.kappa = -30.0f, .epsilon = 1e-9f});
  EXPECT_NEAR(moments.variance, 0.5, 1e-4);
  EXPECT_NEAR(moments.mass, std::pow(std::numbers::pi, 1.5), 1e-4);
}

TEST(KernelMoments, AreLargerForAHarderKernel) {
  EXPECT_GT(momentsOf({.kappa = 5.0f}).variance, 0.8);
  EXPECT_GT(momentsOf({.kappa = 5.0f}).mass, momentsOf({.kappa = 2.0f}).mass);
}

}  // namespace
}  // namespace esvr
