// Plan: the operations of a run are tested on every device. Growth reaches its count and places
// seeds where the error is large. Relocation moves the least useful ellipsoids only. Ellipsoids
// that reach no voxel are dropped, and without an error there are no seeds. A whole fit has the same
// bits in three runs and at a distant position. An optimiser continues from the state of another. Without a GPU, its tests skip.
//
// Errors are counted in the box and at the active voxels. Voxels are sampled in proportion to the squared residual of the allowed signs only. The
// center, the covariance and the height of a seed follow from the residual around it. In the
// Gaussian limit the kernel's moments have closed forms; a harder kernel is wider.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "esvr/error.h"
#include "fit/cpu/residual.h"
#include "fit/optimiser.h"
#include "fit/volumes.h"
#include "support/machine.h"

namespace esvr {
namespace {

class OptimiserOn : public test::OnDevice {
 protected:
  void SetUp() override {
    OnDevice::SetUp();
    options_.device = device_;
  }
  [[nodiscard]] std::unique_ptr<Optimiser> make(const Tuning& tuning = {}) const {
    return makeOptimiser(target_, options_, tuning);
  }
  [[nodiscard]] Field fitAt(Coord shift) const {
    return fit(test::tubeVolume(shift), fitOptions(60, 120)).field;
  }

  [[nodiscard]] FitOptions fitOptions(std::size_t count, std::uint32_t iterations) const {
    FitOptions options;
    options.count = count;
    options.iterations = iterations;
    options.device = options_.device;
    return options;
  }

  /// PSNR of a fit's last state over the box, dB.
  static double psnrOf(const FitResult& result) { return result.curve.back().psnrBox; }

  OptimiserOptions options_;
  SparseVolume volume_ = test::tubeVolume();
  FitTarget target_ = makeTarget(volume_, std::nullopt);
};

TEST_P(OptimiserOn, GrowsToTheCountAndLowersTheLoss) {
  const auto optimiser = make();
  optimiser->growTo(50);
  EXPECT_EQ(optimiser->ellipsoidCount(), 50u);
  const double first = optimiser->iterate(std::array{1.0});
  for (int i = 0; i < 60; ++i) optimiser->iterate(std::array{0.5});
  EXPECT_LT(optimiser->measure().squaredSum, 0.2 * first);
}

TEST_P(OptimiserOn, ManyIterationsInACallAreThoseOfManyCalls) {
  const auto inOne = make(), inMany = make();
  inOne->growTo(30);
  inMany->growTo(30);
  inOne->iterate(std::vector<double>(25, 0.5));
  for (int i = 0; i < 25; ++i) inMany->iterate(std::array{0.5});
  EXPECT_EQ(inOne->measure().squaredSum, inMany->measure().squaredSum);
}

// The errors of a curve come from the pass of the iteration that follows, if the device can share it.
TEST_P(OptimiserOn, MeasuringBeforeAnIterationIsMeasuring) {
  const auto shared = make(), apart = make();
  for (const auto& optimiser : {shared.get(), apart.get()}) optimiser->growTo(40);
  for (int event = 0; event < 3; ++event) {
    const FitErrors found = shared->measureBeforeIteration(), expected = apart->measure();
    EXPECT_DOUBLE_EQ(found.squaredSum, expected.squaredSum);
    EXPECT_DOUBLE_EQ(found.squaredSumBox, expected.squaredSumBox);
    EXPECT_DOUBLE_EQ(found.squaredSumActive, expected.squaredSumActive);
    EXPECT_EQ(found.largest, expected.largest);
    EXPECT_EQ(shared->iterate(std::array{1.0, 1.0}), apart->iterate(std::array{1.0, 1.0}));
    // What changes the ellipsoids must not use the gradients of before.
    (void)shared->measureBeforeIteration();
    (void)apart->measure();
    for (const auto& optimiser : {shared.get(), apart.get()}) {
      optimiser->iterate(std::array{0.0});
      optimiser->relocate(5);
      optimiser->setKappa(0.6f + 0.1f * float(event));
    }
  }
  EXPECT_EQ(shared->measure().squaredSum, apart->measure().squaredSum);
}

// The lists are built anew, so that the steps are not quite the same.
TEST_P(OptimiserOn, ContinuesFromItsState) {
  const std::vector<double> factors(20, 1.0), half(10, 1.0);
  const auto whole = make();
  whole->growTo(40);
  whole->iterate(factors);
  const auto first = make();
  first->growTo(40);
  first->iterate(half);
  const auto second = make();
  second->setState(first->state());
  second->iterate(half);
  EXPECT_EQ(second->ellipsoidCount(), whole->ellipsoidCount());
  EXPECT_NEAR(second->measure().squaredSum, whole->measure().squaredSum,
              0.02 * whole->measure().squaredSum);
  EXPECT_EQ(second->state().adam.front().steps, 20u);
}

// If lists were used for too long, they would miss the parts by which supports have grown. The loss
// of a step must agree with that of new lists, except for the share that lists may miss.
TEST_P(OptimiserOn, LargeStepsSeeTheWholeOfEveryEllipsoid) {
  const auto going = make();
  going->growTo(50);
  for (int done = 0; done < 12; ++done) {
    const auto stopped = make();
    stopped->growTo(50);
    stopped->iterate(std::vector<double>(std::size_t(done), 2.0));
    const double exact = stopped->measure().squaredSum;
    EXPECT_NEAR(going->iterate(std::array{2.0}), exact, 2e-3 * exact) << "after " << done;
  }
}

// The volume's values have one sign. Only with both signs may ellipsoids subtract from the sum.
TEST_P(OptimiserOn, SignsOfIntensitiesAreThoseThatAreAllowed) {
  for (const bool both : {false, true}) {
    target_.bothSigns = both;
    const auto optimiser = make();
    optimiser->growTo(100);
    const double seeded = optimiser->measure().squaredSum;
    optimiser->iterate(std::vector<double>(100, 0.5));
    optimiser->growTo(200);  // the second seeds also see where the sum is too large
    optimiser->iterate(std::vector<double>(100, 0.5));
    const auto found = optimiser->ellipsoids();
    const auto isNegative = [](const Ellipsoid& e) { return e.intensity < 0.0f; };
    EXPECT_EQ(std::any_of(found.begin(), found.end(), isNegative), both);
    EXPECT_LT(optimiser->measure().squaredSum, 0.2 * seeded) << both;
  }
}

TEST_P(OptimiserOn, AContinuedFitIsBetterThanItsStartAndThanOneFromSeeds) {
  FitOptions options = fitOptions(150, 400);
  const FitResult start = fit(volume_, options);
  options.count = 200;
  options.iterations = 100;
  const double fromSeeds = psnrOf(fit(volume_, options));
  options.start = &start.field;
  const FitResult continued = fit(volume_, options);
  EXPECT_GT(continued.field.ellipsoidCount(), start.field.ellipsoidCount());
  EXPECT_GT(psnrOf(continued), psnrOf(start) + 0.5);
  EXPECT_GT(psnrOf(continued), fromSeeds + 0.5);
}

TEST_P(OptimiserOn, AFitDoesNotContinueFromMoreEllipsoidsThanWanted) {
  FitOptions options = fitOptions(20, 60);
  const FitResult first = fit(volume_, options);
  options.start = &first.field;
  options.count = 10;
  EXPECT_THROW((void)fit(volume_, options), UsageError);
}

TEST_P(OptimiserOn, RelocatesTheLeastUsefulAndKeepsTheCount) {
  const auto optimiser = make();
  optimiser->growTo(50);
  for (int i = 0; i < 30; ++i) optimiser->iterate(std::array{0.5});
  const auto before = optimiser->ellipsoids();
  optimiser->relocate(5);
  const auto after = optimiser->ellipsoids();
  ASSERT_EQ(after.size(), 50u);
  int moved = 0;
  for (std::size_t i = 0; i < 50; ++i) moved += before[i].center != after[i].center;
  EXPECT_EQ(moved, 5);
}

TEST_P(OptimiserOn, DropsWhatNoVoxelSees) {
  Tuning tiny;
  tiny.smallestScale = 0.01;
  tiny.largestScale = 0.02;  // supports of a twentieth of a voxel, most of which contain no voxel
  const auto optimiser = make(tiny);
  optimiser->growTo(50);
  for (int i = 0; i < 5; ++i) optimiser->iterate(std::array{1.0});
  optimiser->dropUnseen();
  EXPECT_LT(optimiser->ellipsoidCount(), 50u);
  EXPECT_TRUE(std::isfinite(optimiser->measure().squaredSum));
}

TEST_P(OptimiserOn, AnotherEdgeKeepsTheHalfWidths) {
  const auto optimiser = make();
  optimiser->growTo(20);
  const auto before = optimiser->ellipsoids();
  const double m = kernelWidth(kernelConstants<double>(optimiser->kernel())).m;
  optimiser->setKappa(4.0f);
  EXPECT_EQ(optimiser->kernel().kappa, 4.0f);
  const double moved = kernelWidth(kernelConstants<double>(optimiser->kernel())).m;
  const auto after = optimiser->ellipsoids();
  for (std::size_t i = 0; i < before.size(); ++i)
    for (int k = 0; k < 9; ++k)  // a product of two rounded numbers, one of them a square root
      EXPECT_NEAR(after[i].L[k] / std::sqrt(moved), before[i].L[k] / std::sqrt(m),
                  1e-14 * std::sqrt(before[i].L[0] * before[i].L[0] + 1.0));
}

TEST_P(OptimiserOn, SlopeByKappaIsTheLosssDifference) {
  const auto optimiser = make();
  optimiser->growTo(50);
  for (int i = 0; i < 40; ++i) optimiser->iterate(std::array{0.5});
  EXPECT_NE(optimiser->kappaSlope(), 0.0);
  optimiser->iterate(std::array{0.0});  // computes gradients without a step
  const float kappa = optimiser->kernel().kappa;
  const double slope = optimiser->kappaSlope();
  const auto lossAt = [&](float k) {
    optimiser->setKappa(k);
    return 0.5 * optimiser->measure().squaredSum;
  };
  constexpr float kStep = 1.0f / 64;
  const double difference = (lossAt(kappa + kStep) - lossAt(kappa - kStep)) / (2 * kStep);
  // The error is the third derivative over a step of 1/64, and kinks at the ends of supports.
  EXPECT_NEAR(slope, difference, 0.02 * std::abs(difference));
}

TEST_P(OptimiserOn, SeedsNothingWhereThereIsNothingToMend) {
  std::fill(target_.values.begin(), target_.values.end(), 0.0f);
  const auto optimiser = make();
  optimiser->growTo(50);
  EXPECT_EQ(optimiser->ellipsoidCount(), 0u);
  EXPECT_EQ(optimiser->iterate(std::array{1.0}), 0.0);
}

TEST_P(OptimiserOn, GivesTheSameBitsInThreeRuns) {
  const Field first = fitAt({});
  for (int run = 0; run < 2; ++run) EXPECT_TRUE(test::sameBits(fitAt({}), first));
}

TEST_P(OptimiserOn, AFarPlaceChangesNoBit) {
  const Field here = fitAt({});
  for (const Coord shift :
       {Coord{1 << 20, -(1 << 20), 1 << 20}, Coord{10'000'000, -10'000'000, 8}}) {
    const Field there = fitAt(shift);
    EXPECT_TRUE(test::sameBits(here, there));
    EXPECT_EQ(there.chunks[0].origin, here.chunks[0].origin + shift);
  }
}

ESVR_ON_DEVICES(OptimiserOn);

// ---- Seeds

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
