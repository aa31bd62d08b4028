// Plan: the operations of a run are tested on every device. Growth reaches its count and places
// seeds where the error is large. Relocation moves the least useful ellipsoids only. Ellipsoids
// that reach no voxel are dropped, and without an error there are no seeds. A whole fit has the same
// bits in three runs and at a distant position. An optimiser continues from the state of another. Without a GPU, its tests skip.

#include "fit/optimiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "esvr/error.h"
#include "support/on_device.h"
#include "volumes.h"

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
  EXPECT_TRUE(test::sameBits(fitAt({}), fitAt({1 << 20, -(1 << 20), 1 << 20})));
}

ESVR_ON_DEVICES(OptimiserOn);

}  // namespace
}  // namespace esvr
