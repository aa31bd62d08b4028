// Plan: on a GPU, steps and seeds are those of the CPU, and a whole fit reaches about the same
// PSNR. No single ellipsoid slows down the others, memory is predicted, and a loss that is not
// finite ends a run. Properties of both devices are tested in optimiser_test.cpp.

#include <gmock/gmock.h>

#include <array>
#include <chrono>
#include <cmath>

#include "fit/cpu/cpu_optimiser.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/cuda/memory_plan.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"

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
              testing::ThrowsMessage<DeviceError>(testing::HasSubstr(" ellipsoids would fit")));
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
