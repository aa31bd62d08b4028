// Plan: the paper's loss on the device agrees with the definition of SSIM over dense float64 boxes,
// with the scenes and tolerances of the CPU's test (paper_loss_test.cpp). Bricks of zeros,
// positions and repetition do not change a bit. Gradients and a run of the paper's method agree
// with the CPU's.

#include "fit/paper/cuda_paper_loss.h"

#include <cmath>
#include <limits>

#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "fit/cuda/gpu_test.h"
#include "fit/gradient_scene.h"
#include "fit/paper/paper_loss_scene.h"
#include "fit/paper/paper_optimiser.h"

namespace esvr {
namespace {

using test::LossAndGradient;
using test::Scene;

constexpr double kLossTolerance = 1e-12, kGradientTolerance = 1e-7;

LossAndGradient evaluate(const Scene& scene) {
  const cuda::Stream stream;
  const cuda::BrickTable table(scene.bricks, stream.get());
  const auto residual = test::residualOf(scene);
  const std::span<const float> target(scene.target.data(), scene.targetBricks * kBrickVoxels);
  const cuda::DeviceBuffer<float> r(std::span<const float>(residual), stream.get());
  const cuda::DeviceBuffer<float> t(target, stream.get());
  cuda::PaperLoss loss(stream.get());
  cuda::BrickTable windows({}, stream.get());
  windows.findAround(table, scene.within.value_or(cuda::kAllBricks));
  const float* const device = loss.derivative({.bricks = table,
                                               .windows = windows,
                                               .residual = r.data(),
                                               .target = t.data(),
                                               .targetBricks = scene.targetBricks,
                                               .voxels = scene.voxels,
                                               .beta = scene.beta,
                                               .peak = scene.peak});
  LossAndGradient result{loss.loss(), std::vector<float>(residual.size())};
  cuda::downloadTo(std::span<float>(result.gradient), device, stream.get());
  return result;
}

class PaperLossOnGpu : public test::CudaTest {
 protected:
  static void expectDenseResult(const Scene& scene) {
    const auto [loss, gradient] = evaluate(scene);
    const double reference = denseLoss(scene);
    EXPECT_NEAR(loss, reference, kLossTolerance * reference);
    EXPECT_LT(test::relativeDifference(gradient, denseGradient(scene)), kGradientTolerance);
  }
};

TEST_F(PaperLossOnGpu, IsThatOfTheTextbookForEveryShareOfL1) {
  std::uint64_t seed = 0;
  for (const double beta : {0.0, 0.2, 0.5, 1.0})
    for (const double peak : {0.6, 1.0, 37.0}) {
      Scene scene = test::randomScene(++seed);
      scene.beta = beta;
      scene.peak = peak;
      expectDenseResult(scene);
    }
}

TEST_F(PaperLossOnGpu, OfFewVoxelsIsThatOfTheTextbook) {
  test::Random random(15);
  const auto target = [&](Coord) { return random(0.0, 1.0) < 0.01 ? 0.75f : 0.0f; };
  expectDenseResult(test::makeScene(test::mixedBricks(), 5, target, [&](Coord) {
    return random(0.0, 1.0) < 0.004 ? float(random(0.0, 1.0)) : 0.0f;
  }));
}

TEST_F(PaperLossOnGpu, OfABoxCountsTheWindowsOfItsVoxelsAlone) {
  Scene scene = test::randomScene(13);
  scene.within = Box{{-1, -1, 0}, {0, 1, 1}};
  expectDenseResult(scene);
}

// The variance is 3e-9, a tenth of the rounding error of 0.5^2 in float32; 1 - SSIM is about 1e-5.
TEST_F(PaperLossOnGpu, NoiseOnAnOffsetLosesNoDigits) {
  test::Random random(91);
  const auto noisy = [&](Coord) { return float(0.5 + 1e-4 * random(-1.0, 1.0)); };
  Scene scene = test::makeScene(test::cubeOfBricks(3), 27, noisy, noisy);
  scene.beta = 0.0;
  const auto [loss, gradient] = evaluate(scene);
  EXPECT_NEAR(loss, denseLoss(scene), 1e-7 * denseLoss(scene));
  EXPECT_LT(test::relativeDifference(gradient, denseGradient(scene)), kGradientTolerance);
}

TEST_F(PaperLossOnGpu, BricksOfZerosChangeNoDerivative) {
  const Scene scene = test::randomScene(41);
  const Scene padded = test::withBricksOfZeros(scene);
  auto gradient = evaluate(padded).gradient;
  gradient.resize(scene.target.size());
  EXPECT_EQ(gradient, evaluate(scene).gradient);
}

TEST_F(PaperLossOnGpu, IsTheSameBitsInThreeRunsAndAtAnyPlace) {
  const Scene scene = test::randomScene(61);
  const auto first = evaluate(scene);
  for (int run = 0; run < 2; ++run) {
    EXPECT_EQ(evaluate(scene).gradient, first.gradient);
    EXPECT_EQ(evaluate(scene).loss, first.loss);
  }
  Scene far = scene;
  for (Coord& brick : far.bricks) brick = brick + Coord{-(1 << 20), 1 << 20, 12345};
  EXPECT_EQ(evaluate(far).gradient, first.gradient);
  EXPECT_EQ(evaluate(far).loss, first.loss);
}

TEST_F(PaperLossOnGpu, OfAResidualThatIsNotANumberIsNotANumber) {
  Scene scene = test::randomScene(101);
  scene.prediction[700] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(evaluate(scene).loss));
}

paper::Population somePopulation(std::size_t count) {
  test::Random random(23);
  paper::Population population;
  population.states.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    population.ellipsoids.push_back(
        {{random(0, test::kSide), random(0, test::kSide), random(0, test::kSide)},
         {random(0, 1.5), random(0, 1.5), random(0, 1.5)},
         {random(-1, 1), random(-1, 1), random(-1, 1), 1.0},
         random(0.1, 0.5),
         random(3.0, 7.0)});
  return population;
}

/// Both devices with the same population and options.
class PaperMethodOnGpu : public test::CudaTest {
 protected:
  void start(const paper::KernelKind& kind) {
    startWith(somePopulation(200), kind, test::kSide / 2);
  }
  void startWith(const paper::Population& population, const paper::KernelKind& kind,
                 int subvolumeSide) {
    paper::PaperOptions options{.kind = kind,
                                .beta = 0.2,
                                .subvolumeSide = subvolumeSide,
                                .device = {},
                                .maxDeviceBytes = {},
                                .visitOnly = false};
    cpu_ = paper::makePaperOptimiser(target_, options);
    options.device = device_;
    gpu_ = paper::makePaperOptimiser(target_, options);
    cpu_->put(population);
    gpu_->put(population);
  }

  SparseVolume volume_ = test::denseVolume();
  FitTarget target_ = makeTarget(volume_, std::nullopt);
  std::unique_ptr<paper::PaperOptimiser> cpu_, gpu_;
};

// Both sides are float32 sums over a few thousand voxels, with exponentials precise to 1e-6. If the
// prediction is nearly the target, the sign of L1's derivative may differ: here in one voxel of a
// million.
TEST_F(PaperMethodOnGpu, GradientsAreThoseOfTheCpu) {
  for (const paper::KernelKind kind :
       {paper::KernelKind{}, paper::KernelKind{.gaussian = true}, {.learnK = true}}) {
    start(kind);
    const auto found = gpu_->gradients(3).byEllipsoid, expected = cpu_->gradients(3).byEllipsoid;
    double norm = 0.0, difference = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i)
      for (std::size_t k = 0; k < paper::kPaperParameters; ++k) {
        norm += std::pow(expected[i][k], 2);
        difference += std::pow(found[i][k] - expected[i][k], 2);
      }
    EXPECT_GT(norm, 0.0);
    EXPECT_LT(std::sqrt(difference), 1e-3 * std::sqrt(norm));
  }
}

TEST_F(PaperMethodOnGpu, ARunFollowsTheCpus) {
  start({});
  paper::PaperStep step;
  step.rates.fill(1e-3);
  step.smallestLogScale = -3.0, step.largestLogScale = 3.0;
  for (int epoch = 0; epoch < 5; ++epoch)
    for (std::size_t s = 0; s < cpu_->subvolumeCount(); ++s) {
      cpu_->iterate(s, step);
      gpu_->iterate(s, step);
    }
  // Different signs of L1's derivative separate the two runs, but they reach the same error.
  const double expected = cpu_->measure().squaredSum;
  EXPECT_NEAR(gpu_->measure().squaredSum, expected, 0.01 * expected);
}

// Two bricks lie 20 bricks apart. The ellipsoids have the largest scale that the method allows,
// half the longest axis. Each reaches nearly all of every subvolume, and a hundred thousand other
// bricks.
TEST_F(PaperMethodOnGpu, ItsLargestEllipsoidsReachAllOfAWideSparseTree) {
  constexpr int kApart = 20;  // bricks
  std::vector<BrickInput> bricks(2);
  bricks[1].corner = Coord{kApart, kApart, kApart} * kBrickSide;
  for (BrickInput& brick : bricks) {
    brick.values.fill(0.5f);
    brick.active.setAll();
  }
  volume_ = makeVolume(std::move(bricks), 0.0f);
  target_ = makeTarget(volume_, std::nullopt);
  const double half = 0.5 * (kApart + 1) * kBrickSide, logScale = std::log(half);
  paper::Population population;
  for (const double at : {0.1, 0.5, 0.9})
    population.ellipsoids.push_back({{2 * half * at, half, 2 * half * (1 - at)},
                                     {logScale, logScale, logScale},
                                     {1, 0, 0, 0},
                                     0.2,
                                     5.0});
  population.states.resize(population.size());
  startWith(population, {}, (kApart + 1) / 2 * kBrickSide);
  const double expected = cpu_->measure().squaredSum;
  EXPECT_NEAR(gpu_->measure().squaredSum, expected, 1e-4 * expected);
  EXPECT_EQ(gpu_->pairCount(), cpu_->pairCount());
}

}  // namespace
}  // namespace esvr
