// Plan: on a GPU, steps and seeds are those of the CPU, and a whole fit reaches about the same
// PSNR. No single ellipsoid slows down the others, memory is predicted, and a loss that is not
// finite ends a run. Properties of both devices are tested in optimiser_test.cpp.
//
// All bricks that supports reach are found, also if so many are found at the same time that
// the first table is full before a thread notices it. They are numbered in order, and bricks
// outside a box are not searched. On the host, the tests check the sizes of tables and the clipping
// of ranges.
//
// On the host, the units of integer sums are such that no sum can overflow; they are as fine
// as that allows, and stay within the range of floats for extreme values. On a GPU, the sum of a
// brick with 60,000 entries whose signs nearly cancel agrees with float64, and so do lists of about
// the length at which sums become 64-bit integers.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "core/cuda/device_buffer.h"
#include "core/cuda/integer_sum.cuh"
#include "core/cuda/runtime.h"
#include "fit/cpu/cpu_optimiser.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/cuda/lists.h"
#include "fit/cuda/memory_plan.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"
#include "support/messages.h"

namespace esvr {
namespace {

using cuda::CudaOptimiser;
using OptimiserOnGpu = test::CudaTest;

FitResult fitOn(const Device& device, const SparseVolume& volume) {
  FitOptions options;
  options.count = 60;
  options.iterations = 200;
  options.device = device;
  return fit(volume, options);
}

TEST_F(OptimiserOnGpu, TakesTheStepOfTheCpu) {
  const SparseVolume volume = test::denseVolume();
  FitTarget target = makeTarget(volume, std::nullopt);
  const auto begin = test::randomEllipsoids(50, 1.0, 3.0);
  FitState state = stateOf(begin);
  const Tuning tuning;
  CudaOptimiser onGpu(target, {}, tuning);
  onGpu.setState(state);
  onGpu.iterate(std::array{0.5});

  CpuPass engine(target, kernelConstants<double>(Kernel{}));
  engine.rebuild(begin, 0.5);
  std::vector<EllipsoidGradient> gradients(begin.size());
  engine.gradients(begin, gradients);
  auto expected = begin;
  adamStep(expected, state.adam, gradients,
           {.sizes = tuning.steps.scaled(0.5),
            .options = tuning.adam,
            .limits = {tuning.smallestScale, tuning.largestScale,
                       tuning.intensityHeadroom * target.lowest,
                       tuning.intensityHeadroom * target.highest}});
  const auto found = onGpu.ellipsoids();
  // Adam's first step has the given size and the sign of the gradient. A component can differ only
  // if its gradient is lost in rounding, and then by twice the step.
  int differing = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    for (int a = 0; a < 3; ++a)
      differing += std::abs(found[i].center[a] - expected[i].center[a]) > 1e-6;
  EXPECT_LE(differing, 2);
}

// The rule of motion_bound.h decides when lists are built again, and not the number of steps that
// were started at once, so batches do not change the result. With large steps, supports leave the
// lists within a batch.
TEST_F(OptimiserOnGpu, StepsAheadOfOutgrownListsAreTakenAgain) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  CudaOptimiser inOne(target, {}, {}), inMany(target, {}, {});
  inOne.growTo(200);
  inMany.growTo(200);
  inOne.iterate(std::vector<double>(60, 1.0));
  for (int n = 0; n < 60; ++n) inMany.iterate(std::array{1.0});
  const auto a = inOne.ellipsoids(), b = inMany.ellipsoids();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].center, b[i].center) << i;
    EXPECT_EQ(a[i].L, b[i].L) << i;
    EXPECT_EQ(a[i].intensity, b[i].intensity) << i;
  }
}

TEST_F(OptimiserOnGpu, TheThreadsOfABrickChangeNoBit) {
  const SparseVolume volume = test::denseVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  CudaOptimiser onGpu(target, {}, {});
  onGpu.setEllipsoids(test::randomEllipsoids(2000, 0.5, 4.0));
  const auto expected = onGpu.gradients(cuda::ThreadsPerBrick::threads(0));
  for (int choice = 1; choice < cuda::ThreadsPerBrick::kChoices; ++choice) {
    const auto found = onGpu.gradients(cuda::ThreadsPerBrick::threads(choice));
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].byParameter, expected[i].byParameter) << i;
      EXPECT_EQ(found[i].byKappa, expected[i].byKappa) << i;
    }
  }
}

TEST_F(OptimiserOnGpu, SeedsAsTheCpuDoes) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  CpuOptimiser onCpu(target, {}, {});
  CudaOptimiser onGpu(target, {}, {});
  onCpu.growTo(50);
  onGpu.growTo(50);
  const auto expected = onCpu.ellipsoids(), found = onGpu.ellipsoids();
  // Cumulative energies are integers here and float64 on the CPU. A draw next to the border between
  // two voxels may therefore fall on the other side.
  int differing = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
    differing += std::abs(found[i].center[0] - expected[i].center[0]) +
                     std::abs(found[i].intensity - expected[i].intensity) >
                 1e-6;
  EXPECT_LE(differing, 1);
}

TEST_F(OptimiserOnGpu, ReachesWhatTheCpuReaches) {
  const SparseVolume volume = test::tubeVolume();
  const double onCpu = fitOn({}, volume).curve.back().psnrBox;
  const double onGpu = fitOn(device_, volume).curve.back().psnrBox;
  // The method is the same, but rounding leads to different optima within a decibel of each other.
  EXPECT_NEAR(onGpu, onCpu, 1.0);
}

/// Number of pairs of an ellipsoid and a voxel, for round supports inside the volume.
double voxelPairs(const std::vector<Ellipsoid>& ellipsoids) {
  const double radius = supportRadius(kernelConstants<double>(Kernel{}));
  double sum = 0.0;
  for (const Ellipsoid& p : ellipsoids) sum += 4.18879 * std::pow(radius / p.L[0], 3.0);
  return sum;
}

/// Seconds of an iteration divided by its number of pairs.
double secondsPerPair(const FitTarget& target, const std::vector<Ellipsoid>& ellipsoids) {
  constexpr int kIterations = 50;
  Tuning tuning;
  tuning.largestScale = 64.0;
  CudaOptimiser optimiser(target, {}, tuning);
  optimiser.setEllipsoids(ellipsoids);
  const std::vector<double> factors(kIterations, 1e-6);  // lists do not change
  optimiser.iterate(factors);
  const auto start = std::chrono::steady_clock::now();
  optimiser.iterate(factors);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  return taken.count() / kIterations / voxelPairs(ellipsoids);
}

TEST_F(OptimiserOnGpu, AnEllipsoidThatCoversHalfHoldsNothingUp) {
  const SparseVolume volume = test::volumeOf({}, 24, 0.0f, [](Coord) { return 0.5f; });
  const FitTarget target = makeTarget(volume, std::nullopt);
  test::Random random(3);
  std::vector<Ellipsoid> ellipsoids(50'000);
  for (Ellipsoid& p : ellipsoids)
    p = {{random(0, 192), random(0, 192), random(0, 192)}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0.1};
  const double without = secondsPerPair(target, ellipsoids);
  constexpr double kInverse = 1.0 / 34.0;  // the radius of the support is about 91 voxels
  ellipsoids.push_back({{96, 96, 96}, {kInverse, 0, 0, 0, kInverse, 0, 0, 0, kInverse}, 0.1});
  EXPECT_LT(secondsPerPair(target, ellipsoids), 1.3 * without);
}

TEST_F(OptimiserOnGpu, SaysHowManyEllipsoidsTheMemoryHolds) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  const std::size_t enough = cuda::predictedBytes(target, 100);
  EXPECT_NO_THROW(cuda::requireMemory(target, 100, enough));
  EXPECT_THAT([&] { cuda::requireMemory(target, 1000, enough); },
              test::ThrowsSaying<DeviceError>(" ellipsoids would fit"));
}

TEST_F(OptimiserOnGpu, HoldsNoMoreThanWasPredicted) {
  const SparseVolume volume = test::volumeOf({}, 12, 0.0f, [](Coord v) {
    return float(std::max(0.0, 1.0 - std::hypot(v.x - 48, v.y - 48, v.z - 48) / 40.0));
  });
  FitOptions options;
  options.count = 5000;
  options.iterations = 60;
  options.device = device_;
  const FitTarget target = makeTarget(volume, std::nullopt);
  const FitResult result = fit(volume, options);
  EXPECT_GT(result.deviceBytes, target.values.size() * sizeof(float));
  EXPECT_LT(result.deviceBytes, cuda::predictedBytes(target, 5000));
}

TEST_F(OptimiserOnGpu, ALossThatIsNotFiniteEndsTheRun) {
  const SparseVolume volume = test::tubeVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  CudaOptimiser optimiser(target, {}, {});
  auto ellipsoids = test::randomEllipsoids(5, 1.0, 2.0);
  ellipsoids[2].intensity = std::nan("");
  optimiser.setEllipsoids(ellipsoids);
  EXPECT_THROW(optimiser.iterate(std::array{1.0}), RuntimeFailure);
}

}  // namespace
}  // namespace esvr

// ---- The table of bricks

namespace esvr::cuda {
namespace {

TEST(TableSlots, AreAPowerOfTwoAndAtMostHalfUsed) {
  for (const std::size_t entries : {0, 1, 2, 1000, 4095, 4096, 1'000'000}) {
    const std::size_t slots = slotsFor(entries);
    EXPECT_EQ(slots & (slots - 1), 0u);
    EXPECT_GT(slots, 2 * entries);
    EXPECT_LE(slots, 4 * entries + 4);
  }
}

Ellipsoid sphereAt(Coord brick, double scale) {
  const double l = 1.0 / scale;
  return {{brick.x * 8.0 + 3.5, brick.y * 8.0 + 3.5, brick.z * 8.0 + 3.5},
          {l, 0, 0, 0, l, 0, 0, 0, l},
          1.0};
}

// Supports in the paper's method may cover half the volume. To visit all their bricks for a
// subvolume with few bricks would take longer than the fit.
TEST(ClippedRange, OfAHugeSupportIsTheBoxOfBricks) {
  const Ellipsoid p = sphereAt({0, 0, 0}, 1e5);
  const Support support = makeSupport(p.center, p.L, 2.0, 0.0);
  const Box within{{-2, 0, 5}, {3, 1, 9}};
  EXPECT_EQ(clippedRange(support, within), within);
  EXPECT_GT(clippedRange(support, kAllBricks).volume(), 1e13);
  const Ellipsoid far = sphereAt({100, 0, 0}, 1.0);
  EXPECT_TRUE(clippedRange(makeSupport(far.center, far.L, 2.0, 0.0), within).empty());
}

class BrickTableOnGpu : public test::CudaTest {
 protected:
  void find(BrickTable& table, const std::vector<Ellipsoid>& ellipsoids, const Box& within) {
    const DeviceBuffer<Ellipsoid> device(std::span<const Ellipsoid>(ellipsoids), stream_->get());
    table.findReached(sourceOf(device), within);
    stream_->synchronize();
  }
  static SupportSource sourceOf(const DeviceBuffer<Ellipsoid>& ellipsoids) {
    return {
        .ellipsoids = ellipsoids.data(), .count = ellipsoids.size(), .radius = 2.0, .slack = 0.0};
  }
  std::vector<Coord> bricksOf(const BrickTable& table) {
    std::vector<Coord> bricks(table.size());
    downloadTo(std::span<Coord>(bricks), table.view().bricks, stream_->get());
    return bricks;
  }
  void SetUp() override {
    CudaTest::SetUp();
    if (!IsSkipped()) stream_.emplace();
  }
  std::optional<Stream> stream_;
};

// 200,000 bricks are inserted into a table of 4096 slots. Without a limit on probes, a thread that
// finds every slot taken by other bricks would never end.
TEST_F(BrickTableOnGpu, FindsMoreBricksAtOnceThanTheFirstTableHolds) {
  std::vector<Ellipsoid> ellipsoids;
  std::vector<Coord> expected;
  for (int n = 0; n < 200'000; ++n) {
    expected.push_back({n / 2000 * 3, n / 50 % 40 * 3, n % 50 * 3});
    ellipsoids.push_back(sphereAt(expected.back(), 1.0));
  }
  std::sort(expected.begin(), expected.end());
  for (int run = 0; run < 3; ++run) {
    BrickTable table({}, stream_->get());
    find(table, ellipsoids, kAllBricks);
    EXPECT_EQ(bricksOf(table), expected);
  }
}

TEST_F(BrickTableOnGpu, FindsOnlyTheBricksOfABox) {
  const Box within{{-1, -1, -1}, {1, 2, 1}};
  const std::vector<Coord> targets{{0, 0, 0}, {1, 2, 1}};
  BrickTable table(targets, stream_->get());
  find(table, {sphereAt({0, 0, 0}, 1e5)}, within);
  const auto bricks = bricksOf(table);
  ASSERT_EQ(bricks.size(), 36u);
  EXPECT_EQ(std::vector<Coord>(bricks.begin(), bricks.begin() + 2), targets);
  EXPECT_TRUE(std::is_sorted(bricks.begin() + 2, bricks.end()));
  for (const Coord b : bricks) EXPECT_TRUE(within.contains(b));
}

// The walk over a support that reaches 10^14 bricks visits only existing bricks.
TEST_F(BrickTableOnGpu, AnEllipsoidOverEverythingIsPairedWithEveryBrickOnce) {
  std::vector<Coord> targets;
  for (int n = 0; n < 1000; ++n) targets.push_back({n % 10 * 5, n / 10 % 10 * 7, n / 100});
  std::sort(targets.begin(), targets.end());
  const BrickTable table(targets, stream_->get());
  const DeviceBuffer<Ellipsoid> ellipsoids(
      std::vector<Ellipsoid>{sphereAt({3, 3, 3}, 1e6), sphereAt(targets[17], 0.5)}, stream_->get());
  PairLists lists(stream_->get());
  lists.rebuild(sourceOf(ellipsoids), table);
  EXPECT_EQ(lists.pairCount(), 1001u);
}

}  // namespace
}  // namespace esvr::cuda

// ---- Sums of integers

namespace esvr {
namespace {

using cuda::kLimits32;
using cuda::kLimits64;
using cuda::SumLimits;
using cuda::unitExponent;

TEST(IntegerSum, NeverLeavesItsBits) {
  test::Random random(3);
  for (int n = 0; n < 10'000; ++n) {
    const auto largest = float(std::exp2(random(-60, 60)));
    const auto count = std::uint32_t(std::exp2(random(0, 31)));
    for (const SumLimits& limits : {kLimits32, kLimits64, SumLimits{21, 29}}) {
      const int e = unitExponent(largest, count, limits);
      const double sum = double(largest) * count * std::exp2(e);
      EXPECT_LT(sum, std::exp2(limits.sumBits + 1) * (1 + 1e-6)) << largest << " " << count;
      EXPECT_LT(double(largest) * std::exp2(e), std::exp2(limits.valueBits + 1));
      if (std::abs(e) == 126) continue;
      EXPECT_TRUE(sum >= std::exp2(limits.sumBits) * (1 - 1e-6) ||
                  double(largest) * std::exp2(e) >= std::exp2(limits.valueBits));
    }
  }
}

TEST(IntegerSum, OfNothingOrExtremesHasUnitsThatFloatsHave) {
  EXPECT_EQ(unitExponent(0.0f, 10, kLimits32), 0);
  EXPECT_EQ(unitExponent(1.0f, 0, kLimits32), 0);
  EXPECT_EQ(unitExponent(std::nanf(""), 10, kLimits32), 0);
  EXPECT_EQ(unitExponent(1e-45f, 1, kLimits64), 126);
  EXPECT_GE(unitExponent(3e38f, 4'000'000'000u, kLimits32), -126);
}

TEST(WideBricks, AreAtMostAsManyAsThePairsAllow) {
  cuda::PassScene scene{};
  scene.brickCount = 100;
  scene.ellipsoidCount = 1'000'000;
  scene.pairCount = cuda::kMaxNarrowEntries - 1;
  EXPECT_EQ(cuda::maxWideBricks(scene), 0u);
  scene.pairCount = 3 * cuda::kMaxNarrowEntries + 5;
  EXPECT_EQ(cuda::maxWideBricks(scene), 3u);
  scene.pairCount = 4'000'000'000u;
  EXPECT_EQ(cuda::maxWideBricks(scene), 100u);
  scene.ellipsoidCount = cuda::kMaxNarrowEntries;  // no list can be longer
  EXPECT_EQ(cuda::maxWideBricks(scene), 0u);
}

/// Pairs of ellipsoids at the same place whose intensities differ by 2^-18, all near one brick.
std::vector<Ellipsoid> cancellingPairs(std::size_t count) {
  test::Random random(11);
  std::vector<Ellipsoid> ellipsoids;
  while (ellipsoids.size() < count) {
    const double l = 1.0 / random(0.6, 1.0);
    Ellipsoid p{{11.5 + random(-2, 2), 11.5 + random(-2, 2), 11.5 + random(-2, 2)},
                {l, 0, 0, 0, l, 0, 0, 0, l},
                1.0};
    ellipsoids.push_back(p);
    p.intensity = -1.0 + 0x1p-18;
    ellipsoids.push_back(p);
  }
  return ellipsoids;
}

/// The sum over all voxels of the squared sum of ellipsoids, in float64.
double squaredSum(const std::vector<Ellipsoid>& ellipsoids, const Kernel& kernel) {
  const auto k = kernelConstants<double>(kernel);
  double sum = 0.0;
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z) {
        double value = 0.0;
        for (const Ellipsoid& p : ellipsoids) {
          const double d2 = std::pow(x - p.center[0], 2) + std::pow(y - p.center[1], 2) +
                            std::pow(z - p.center[2], 2);
          value += p.intensity * kernelPhi(k, d2 * p.L[0] * p.L[0]);
        }
        sum += value * value;
      }
  return sum;
}

class LongListsOnGpu : public test::CudaTest, public testing::WithParamInterface<std::size_t> {};

// With 32 bits, 60,000 entries have units of 2^-13, and the rounding of all of them would add at
// least 3 % to the squares. The units of short lists are finer; their rounding adds at most 0.4 %.
TEST_P(LongListsOnGpu, SumAsPreciselyAsFloat64) {
  const SparseVolume volume = test::volumeOf({}, 3, 0.0f, [](Coord) { return 0.5f; });
  FitTarget target = makeTarget(volume, std::nullopt);
  std::fill(target.values.begin(), target.values.end(), 0.0f);
  const auto ellipsoids = cancellingPairs(GetParam());
  OptimiserOptions options;
  cuda::CudaOptimiser optimiser(target, options, {});
  optimiser.setEllipsoids(ellipsoids);
  const double expected = squaredSum(ellipsoids, options.kernel);
  EXPECT_NEAR(optimiser.measure().squaredSum, expected, 1e-2 * expected);
}
INSTANTIATE_TEST_SUITE_P(Lengths, LongListsOnGpu,
                         testing::Values(64u, 4096u, 4098u, 20'000u, 60'000u));

}  // namespace
}  // namespace esvr
