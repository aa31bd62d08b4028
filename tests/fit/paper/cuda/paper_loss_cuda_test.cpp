// Plan: the paper's loss on the device against the textbook's formula over dense float64 boxes,
// with the scenes and tolerances of the CPU's test (paper_loss_test.cpp): shares of L1, few voxels,
// windows of a box alone, bright flat regions; what must be exact: bricks of zeros, places, three
// runs; gradients by ellipsoids against the CPU's.

#include "fit/paper/cuda/paper_loss.h"

#include <cmath>
#include <limits>

#include "../../cuda/gpu_test.h"
#include "../../random_ellipsoids.h"
#include "../paper_loss_scene.h"
#include "core/cuda/stream.h"
#include "fit/cpu/cpu_optimiser.h"
#include "fit/cuda/copy.h"
#include "fit/cuda/cuda_optimiser.h"

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

class PaperLossOnGpu : public test::OnGpu {
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

// The variance is 3e-9, a tenth of what rounding 0.5^2 to float32 costs; 1 - SSIM is of order 1e-5.
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
  Scene padded = scene;
  for (int i = 0; i < 125; ++i) {
    const Coord brick{i / 25 - 3, i / 5 % 5 - 2, i % 5 - 2};
    if (std::find(scene.bricks.begin(), scene.bricks.end(), brick) == scene.bricks.end())
      padded.bricks.push_back(brick);
  }
  padded.target.resize(padded.bricks.size() * kBrickVoxels);
  padded.prediction.resize(padded.target.size(), -0.0f);
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

std::vector<EllipsoidGradient> gradientsOnCpu(const FitTarget& target, const Kernel& kernel,
                                              double beta,
                                              const std::vector<Ellipsoid>& ellipsoids) {
  CpuPass engine(target, kernelConstants<double>(kernel));
  engine.rebuild(ellipsoids, 0.5);
  std::vector<float> residuals, lossByValue;
  engine.residuals(ellipsoids, residuals);
  PaperLoss loss;
  loss.evaluate({engine.index(), residuals, target.values, target.boxVoxels, beta,
                 target.highest - target.lowest},
                lossByValue);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  engine.gradientsOf(ellipsoids, lossByValue, gradients);
  return gradients;
}

// Float32 sums over some thousand voxels on both sides, and an exponential within 1e-6. Where the
// prediction is nearly the target L1's sign may differ: in a voxel of a million here.
TEST_F(PaperLossOnGpu, GradientsByEllipsoidsAreThoseOfTheCpu) {
  const SparseVolume volume = test::denseVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  for (const Kernel& kernel : {Kernel{.form = KernelForm::kPaper, .kappa = 5.0f},
                               Kernel{.kappa = -30.0f}, Kernel{.kappa = 2.0f}}) {
    const auto ellipsoids = test::randomEllipsoids(200, 0.5, 4.0);
    OptimiserOptions options;
    options.kernel = kernel;
    options.loss = Loss::kPaper;
    cuda::CudaOptimiser onGpu(target, options, {});
    onGpu.setEllipsoids(ellipsoids);
    const auto found = onGpu.gradients();
    const auto expected = gradientsOnCpu(target, kernel, options.beta, ellipsoids);
    double norm = 0.0, difference = 0.0;
    for (std::size_t i = 0; i < found.size(); ++i)
      for (int k = 0; k < kParameters; ++k) {
        norm += std::pow(expected[i].byParameter[k], 2);
        difference += std::pow(found[i].byParameter[k] - expected[i].byParameter[k], 2);
      }
    EXPECT_LT(std::sqrt(difference), 1e-3 * std::sqrt(norm)) << kernel.kappa;
  }
}

TEST_F(PaperLossOnGpu, AFitFollowsTheCpus) {
  const SparseVolume volume = test::denseVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  OptimiserOptions options;
  options.kernel.kappa = 2.0f;
  options.loss = Loss::kPaper;
  cuda::CudaOptimiser onGpu(target, options, {});
  CpuOptimiser onCpu(target, options, {});
  for (Optimiser* optimiser : {static_cast<Optimiser*>(&onGpu), static_cast<Optimiser*>(&onCpu)}) {
    optimiser->growTo(100);
    optimiser->iterate(std::vector<double>(20, 0.5));
    optimiser->relocate(5);
    optimiser->iterate(std::vector<double>(10, 0.5));
  }
  // Signs of L1 and draws part the two after a while: they agree in what they reach.
  EXPECT_NEAR(onGpu.measure().squaredSum, onCpu.measure().squaredSum,
              0.03 * onCpu.measure().squaredSum);
}

}  // namespace
}  // namespace esvr
