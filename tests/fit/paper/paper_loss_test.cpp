// Plan: (1) loss and gradient agree with the definition of SSIM over dense float64 boxes; (2) the
// gradient agrees with central differences of that dense loss; (3) the loss agrees with the public
// metric; (4) identical volumes, bricks of zeros, threads, powers of two, positions and earlier
// calls have exact results; (5) flat bright regions, where variances cancel, are precise; (6) wrong
// input is refused.
//
// Tolerances. The loss is summed in float64. The moments have errors of a few 2.2e-16 of squared
// values of order 1 and are divided by C2 = 9e-4 or more, in the library and in the definition. The
// tolerance of the loss is therefore 1e-12. The gradient is float32, and so are two of its three
// parts. Their roundings are at most 6e-8, with signs that differ from voxel to voxel. The
// tolerance of the gradient is therefore 1e-7 of its norm.
//
// On every device, the gradient of the paper's loss over one subvolume by every parameter of
// the paper (position, log scales, quaternion of any length, intensity, k) is compared with central
// differences of a float64 loss by the paper's formula at every voxel, with SSIM by its definition.
// The cases are the paper's ellipsoids, Gaussians, and ellipsoids of different k. The paper's
// ellipsoid and the form that passes use are the same function. A GPU that holds one subvolume at a
// time computes the same bits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "field/random_field.h"
#include "fit/gradient_scene.h"
#include "fit/paper/paper_loss.h"
#include "fit/paper/paper_loss_scene.h"
#include "fit/paper/paper_optimiser.h"
#include "support/machine.h"

namespace esvr {
namespace {

using test::boxAround;
using test::cubeOfBricks;
using test::denseGradient;
using test::denseLoss;
using test::denseOf;
using test::densePrediction;
using test::DenseValues;
using test::kMargin;
using test::LossAndGradient;
using test::makeScene;
using test::mixedBricks;
using test::randomScene;
using test::relativeDifference;
using test::residualOf;
using test::Scene;

constexpr double kLossTolerance = 1e-12, kGradientTolerance = 1e-7;

LossAndGradient evaluate(const Scene& scene, PaperLoss& loss) {
  const BrickIndex index(scene.bricks);
  const auto residual = residualOf(scene);
  const std::span target(scene.target.data(), scene.targetBricks * kBrickVoxels);
  LossAndGradient result;
  result.loss =
      loss.evaluate({index, residual, target, scene.voxels, scene.beta, scene.peak, scene.within},
                    result.gradient);
  return result;
}

LossAndGradient evaluate(const Scene& scene) {
  PaperLoss loss;
  return evaluate(scene, loss);
}

void expectDenseResult(const Scene& scene) {
  const auto [loss, gradient] = evaluate(scene);
  const double reference = denseLoss(scene);
  EXPECT_NEAR(loss, reference, kLossTolerance * reference);
  EXPECT_LT(relativeDifference(gradient, denseGradient(scene)), kGradientTolerance);
}

struct Share {
  std::uint64_t seed;
  double beta, peak;
};
class AgainstDense : public testing::TestWithParam<Share> {};

TEST_P(AgainstDense, SlowLossAndGradientAreThoseOfTheTextbook) {
  Scene scene = randomScene(GetParam().seed);
  scene.beta = GetParam().beta;
  scene.peak = GetParam().peak;
  expectDenseResult(scene);
}

INSTANTIATE_TEST_SUITE_P(Shares, AgainstDense,
                         testing::Values(Share{1, 0.0, 1.0}, Share{2, 0.2, 1.0}, Share{3, 1.0, 1.0},
                                         Share{4, 0.2, 0.6}, Share{5, 0.5, 37.0}));

TEST(PaperLoss, SlowOfABoxCountsTheWindowsOfItsVoxelsAlone) {
  Scene scene = randomScene(13);
  scene.within = Box{{-1, -1, 0}, {0, 1, 1}};
  expectDenseResult(scene);
}

// Most voxels are zero, and some are predicted exactly. Windows may skip those voxels, but must not
// skip others.
TEST(PaperLoss, SlowOfFewVoxelsIsThatOfTheTextbook) {
  test::Random random(15);
  const auto target = [&](Coord) { return random(0.0, 1.0) < 0.01 ? 0.75f : 0.0f; };
  Scene scene = makeScene(mixedBricks(), 5, target, [&](Coord) {
    return random(0.0, 1.0) < 0.004 ? float(random(0.0, 1.0)) : 0.0f;
  });
  for (std::size_t v = 0; v < scene.target.size(); ++v)
    if (v / kBrickVoxels % 2 == 0) scene.prediction[v] = scene.target[v];
  expectDenseResult(scene);
}

// Differences with step h have an error of h^2 / 6 times the third derivative. SSIM changes over
// sqrt(C2) = 0.03 of the values of a window, in which a voxel has a weight of at most 0.02, so the
// error is below (1e-3 * 0.02 / 0.03)^2 < 1e-6. The rounding, 1e-16 of the loss / (2 h), is far
// smaller. No residual is within h of the kink of L1.
TEST(PaperLossGradient, SlowAgreesWithCentralDifferences) {
  constexpr double kStep = 1e-3;
  Scene scene = randomScene(11, {{-1, 0, 0}, {0, -1, 0}});
  const DenseValues target = denseOf(scene, scene.target);
  DenseValues prediction = densePrediction(scene);
  const auto gradient = evaluate(scene).gradient;

  std::vector<float> values;
  std::vector<double> differences;
  for (std::size_t v = 3; v < gradient.size(); v += 41) {
    const Coord at =
        scene.bricks[v / kBrickVoxels] * kBrickSide + voxelLocal(int(v % kBrickVoxels));
    if (std::abs(prediction.at(at) - target.at(at)) < 2.0 * kStep) continue;
    const double value = prediction.at(at);
    const auto lossAt = [&](double changed) {
      prediction[at] = changed;
      return test::densePaperLoss(prediction, target, {scene.voxels, scene.beta, scene.peak});
    };
    differences.push_back((lossAt(value + kStep) - lossAt(value - kStep)) / (2.0 * kStep));
    values.push_back(gradient[v]);
    prediction[at] = value;
  }
  ASSERT_GT(values.size(), 20u);
  EXPECT_LT(relativeDifference(values, differences), 1e-6);
}

SparseVolume volumeOf(const Scene& scene, const std::vector<float>& values) {
  std::vector<BrickInput> bricks;
  for (std::size_t b = 0; b < scene.bricks.size(); ++b) {
    BrickInput brick{.corner = scene.bricks[b] * kBrickSide, .values = {}, .active = {}};
    std::copy_n(&values[b * kBrickVoxels], kBrickVoxels, brick.values.begin());
    brick.active.setAll();
    bricks.push_back(brick);
  }
  return makeVolume(std::move(bricks), 0.0f);
}

TEST(PaperLoss, IsOneMinusTheMetricWhereNoWindowThatSeesABrickIsClipped) {
  Scene scene = randomScene(21);
  const Box box = boxAround(scene.bricks, 2 * kMargin);
  scene.voxels = box.volume();
  scene.beta = 0.0;
  // The values are multiples of 2^-10, so that the residual is the exact difference of the volumes.
  for (auto* values : {&scene.target, &scene.prediction})
    for (float& v : *values) v = std::round(v * 1024.0f) / 1024.0f;
  const double ssim =
      ssim3d(volumeOf(scene, scene.target), volumeOf(scene, scene.prediction), box, scene.peak);
  EXPECT_NEAR(evaluate(scene).loss, 1.0 - ssim, kLossTolerance);
}

TEST(PaperLoss, OfIdenticalVolumesIsZeroAndSoIsItsGradient) {
  Scene scene = randomScene(31);
  scene.targetBricks = scene.bricks.size();
  scene.target = scene.prediction;
  const auto [loss, gradient] = evaluate(scene);
  EXPECT_EQ(loss, 0.0);
  EXPECT_EQ(gradient, std::vector<float>(gradient.size(), 0.0f));
}

TEST(PaperLoss, BricksOfZerosChangeNoBit) {
  const Scene scene = randomScene(41);
  const Scene padded = test::withBricksOfZeros(scene);
  const auto [loss, gradient] = evaluate(scene);
  auto [paddedLoss, paddedGradient] = evaluate(padded);
  EXPECT_EQ(paddedLoss, loss);
  paddedGradient.resize(gradient.size());
  EXPECT_EQ(paddedGradient, gradient);
}

TEST(PaperLoss, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = randomScene(51);
  const auto loss = [&] { return evaluate(scene); };
  const auto one = test::onThreads(1, loss), four = test::onThreads(4, loss);
  EXPECT_EQ(one.loss, four.loss);
  EXPECT_EQ(one.gradient, four.gradient);
}

TEST(PaperLoss, IsTheSameAtAnyPlaceOfIndexSpace) {
  const Scene scene = randomScene(61);
  Scene far = scene;
  for (Coord& brick : far.bricks) brick = brick + Coord{-(1 << 20), 1 << 20, 12345};
  EXPECT_EQ(evaluate(far).loss, evaluate(scene).loss);
  EXPECT_EQ(evaluate(far).gradient, evaluate(scene).gradient);
}

TEST(PaperLoss, ValuesAndPeakScaledByAPowerOfTwoChangeNoBit) {
  const Scene scene = randomScene(71);
  const auto [loss, gradient] = evaluate(scene);
  for (const float scale : {0x1p-70f, 0x1p70f}) {
    Scene scaled = scene;
    scaled.peak *= double(scale);
    for (auto* values : {&scaled.target, &scaled.prediction})
      for (float& v : *values) v *= scale;
    auto [scaledLoss, scaledGradient] = evaluate(scaled);
    EXPECT_EQ(scaledLoss, loss);
    for (float& g : scaledGradient) g *= scale;
    EXPECT_EQ(scaledGradient, gradient);
  }
}

TEST(PaperLoss, DoesNotDependOnEarlierCalls) {
  PaperLoss used;
  Scene other = randomScene(81);
  other.bricks.resize(5);
  other.target.resize(5 * kBrickVoxels);
  other.prediction.resize(5 * kBrickVoxels);
  const Scene scene = randomScene(82);
  (void)evaluate(scene, used);
  const auto second = evaluate(other, used);
  EXPECT_EQ(second.loss, evaluate(other).loss);
  EXPECT_EQ(second.gradient, evaluate(other).gradient);
  EXPECT_EQ(evaluate(scene, used).loss, evaluate(scene).loss);
}

TEST(PaperLoss, OfNoBricksIsZero) {
  Scene empty;
  EXPECT_EQ(evaluate(empty).loss, 0.0);
  EXPECT_TRUE(evaluate(empty).gradient.empty());
}

// The variance is 3e-9, a tenth of the rounding error of 0.5^2 in float32.
TEST(PaperLossOnFlatRegions, SlowNoiseOnAnOffsetLosesNoDigits) {
  test::Random random(91);
  const auto noisy = [&](Coord) { return float(0.5 + 1e-4 * random(-1.0, 1.0)); };
  Scene scene = makeScene(cubeOfBricks(3), 27, noisy, noisy);
  scene.beta = 0.0;
  const double reference = denseLoss(scene);
  // 1 - SSIM is about 1e-5, and the textbook's own value has an error of 1e-12.
  EXPECT_NEAR(evaluate(scene).loss, reference, 1e-7 * reference);
  EXPECT_LT(relativeDifference(evaluate(scene).gradient, denseGradient(scene)), kGradientTolerance);
}

// A constant difference in a bright region. Of the gradient only the share of the means remains,
// which is 1e-3 of each of the two terms that cancel.
TEST(PaperLossOnFlatRegions, SlowAConstantDifferenceKeepsItsSmallGradient) {
  Scene scene = makeScene(
      cubeOfBricks(3), 27, [](Coord) { return 0.9f; }, [](Coord) { return 0.91f; });
  scene.beta = 0.0;
  const auto gradient = evaluate(scene).gradient;
  const auto reference = denseGradient(scene);
  for (int i = 0; i < 64; ++i) {  // the voxels 10 to 13, whose windows overlap flat windows only
    const std::size_t v =
        13 * kBrickVoxels + std::size_t(voxelOffset(Coord{2 + i / 16, 2 + i / 4 % 4, 2 + i % 4}));
    EXPECT_NEAR(gradient[v], reference[v], 2e-7 * std::abs(reference[v]));
  }
}

TEST(PaperLoss, OfAResidualThatIsNotANumberIsNotANumber) {
  Scene scene = randomScene(101);
  scene.prediction[700] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(std::isnan(evaluate(scene).loss));
}

TEST(PaperLoss, RefusesWhatMakesNoSense) {
  const auto with = [](double voxels, double beta, double peak) {
    Scene scene = randomScene(111);
    scene.voxels = voxels;
    scene.beta = beta;
    scene.peak = peak;
    return scene;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)evaluate(with(0.0, 0.2, 1.0)), UsageError);
  EXPECT_THROW((void)evaluate(with(1.0, -0.1, 1.0)), UsageError);
  EXPECT_THROW((void)evaluate(with(1.0, 1.1, 1.0)), UsageError);
  EXPECT_THROW((void)evaluate(with(1.0, kNan, 1.0)), UsageError);
  EXPECT_THROW((void)evaluate(with(1.0, 0.2, 0.0)), UsageError);
  EXPECT_THROW((void)evaluate(with(1.0, 0.2, kNan)), UsageError);
}

TEST(PaperLoss, RefusesArraysThatDoNotFitTheBricks) {
  Scene scene = randomScene(121);
  scene.bricks.pop_back();
  EXPECT_THROW((void)evaluate(scene), std::logic_error);
}

}  // namespace
}  // namespace esvr

// ---- Gradients

namespace esvr::paper {
namespace {

constexpr int kSubvolume = 7;  // the last of 2 x 2 x 2 subvolumes, each a brick
const Box kBrick{{8, 8, 8}, {15, 15, 15}};

SparseVolume smallVolume() { return test::randomBricks(test::cornersOfCube(2), 3); }

Population fewEllipsoids() {
  Population population;
  population.ellipsoids = {{{11.3, 12.1, 10.7}, {1.1, 0.4, -0.2}, {0.9, 0.2, -0.4, 0.3}, 0.6, 5.0},
                           {{9.1, 9.7, 13.2}, {0.5, 1.2, 0.3}, {1.7, -0.3, 0.8, 0.1}, 0.3, 3.2},
                           {{6.4, 14.8, 9.9}, {1.0, 1.0, 1.3}, {0.2, 0.3, 0.1, -0.2}, -0.2, 7.5}};
  population.states.resize(population.size());
  return population;
}

/// The paper's eq. 5, or a Gaussian that ends at 3 sigma, shifted so that it ends at 0.
double kernelAt(double q, double k, bool gaussian) {
  const auto sigma = [](double x) { return 1.0 / (1.0 + std::exp(-x)); };
  if (gaussian) {
    const double end = double(float(std::exp(-4.5)));
    return std::max(0.0, (std::exp(-0.5 * q) - end) / (1.0 - end));
  }
  const auto phi = [&](double of, double at) { return sigma(of * (1.0 - at)) / sigma(of); };
  const double last = phi(5.0, double(Kernel::kPaperCutoff) * double(Kernel::kPaperCutoff));
  return phi(k, q) > last ? phi(k, q) : 0.0;
}

double squaredDistance(const PaperEllipsoid& p, Coord v) {
  const Matrix3 R = rotationOf(normalised(p.rotation));
  const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
  double q = 0.0;
  for (int j = 0; j < 3; ++j) {
    const double along = R[j] * d[0] + R[3 + j] * d[1] + R[6 + j] * d[2];
    q += std::pow(along * std::exp(-p.logScale[j]), 2);
  }
  return q;
}

class DenseLoss {
 public:
  DenseLoss(const FitTarget& target, const KernelKind& kind, double beta)
      : kind_(kind), target_(paddedBrick()) {
    options_ = {kBrick.volume(), beta, target.highest - target.lowest, kBrick};
    forEachVoxel([&](Coord v) {
      target_[v] =
          double(target.values[kSubvolume * kBrickVoxels + std::size_t(voxelOffset(localOf(v)))]);
    });
  }
  [[nodiscard]] double operator()(const Population& population) const {
    test::DenseValues prediction(paddedBrick());
    forEachVoxel([&](Coord v) {
      for (const PaperEllipsoid& p : population.ellipsoids)
        prediction[v] += p.intensity * kernelAt(squaredDistance(p, v), kind_.learnK ? p.k : kind_.k,
                                                kind_.gaussian);
    });
    return test::densePaperLoss(prediction, target_, options_);
  }

 private:
  static Box paddedBrick() { return {Coord{3, 3, 3}, Coord{20, 20, 20}}; }
  template <class Visit>
  static void forEachVoxel(Visit&& visit) {
    for (int v = 0; v < kBrickVoxels; ++v) visit(kBrick.min + voxelLocal(v));
  }
  KernelKind kind_;
  test::DenseValues target_;
  test::DenseLossOptions options_{};
};

double& parameter(PaperEllipsoid& p, int n) {
  if (n < 3) return p.center[n];
  if (n < 6) return p.logScale[n - 3];
  if (n < 10) return p.rotation[n - 6];
  return n == 10 ? p.intensity : p.k;
}

class PaperGradientOn : public test::OnDevice {
 protected:
  // The loss is of order 1 in float64, so differences with a step of 1e-6 have errors of about
  // 1e-10, for gradients of 1e-3. The step is so small because the paper's kernel jumps at its end.
  // The gradient is a float32 sum over a brick's voxels, with an exponential precise to 1e-6 on the
  // GPU.
  void expectDifferences(const KernelKind& kind) const {
    constexpr double kStep = 1e-6, kTolerance = 1e-4, kBeta = 0.2;
    const SparseVolume volume = smallVolume();
    const FitTarget target = makeTarget(volume, std::nullopt);
    const auto optimiser = makePaperOptimiser(target, {.kind = kind,
                                                       .beta = kBeta,
                                                       .subvolumeSide = kBrickSide,
                                                       .device = device_,
                                                       .maxDeviceBytes = {},
                                                       .visitOnly = false});
    ASSERT_EQ(optimiser->subvolumeCount(), 8u);
    const Population population = fewEllipsoids();
    optimiser->put(population);
    const LossGradients found = optimiser->gradients(kSubvolume);
    const DenseLoss loss(target, kind, kBeta);
    EXPECT_NEAR(found.loss, loss(population), 1e-5);
    for (std::size_t i = 0; i < population.size(); ++i) {
      double error = 0.0, norm = 0.0;
      for (int n = 0; n < kPaperParameters; ++n) {
        if (n == kPaperParameters - 1 && !kind.learnK) continue;
        const auto lossAt = [&](double step) {
          Population moved = population;
          parameter(moved.ellipsoids[i], n) += step;
          return loss(moved);
        };
        const double difference = (lossAt(kStep) - lossAt(-kStep)) / (2.0 * kStep);
        error += std::pow(found.byEllipsoid[i][n] - difference, 2);
        norm += difference * difference;
      }
      EXPECT_LT(std::sqrt(error), kTolerance * std::sqrt(norm)) << "ellipsoid " << i;
    }
  }
};

TEST_P(PaperGradientOn, SlowOfThePapersEllipsoidAgreesWithDifferences) { expectDifferences({}); }
TEST_P(PaperGradientOn, SlowOfGaussiansAgreesWithDifferences) {
  expectDifferences({.gaussian = true});
}
TEST_P(PaperGradientOn, SlowOfOwnKAgreesWithDifferences) { expectDifferences({.learnK = true}); }

TEST_P(PaperGradientOn, IsTheSameWhereOnlyTheVisitedSubvolumeIsThere) {
  const SparseVolume volume = smallVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  PaperOptions options{.kind = {},
                       .beta = 0.2,
                       .subvolumeSide = kBrickSide,
                       .device = device_,
                       .maxDeviceBytes = {},
                       .visitOnly = false};
  const auto all = makePaperOptimiser(target, options);
  options.visitOnly = true;
  const auto visited = makePaperOptimiser(target, options);
  PaperStep step;
  step.rates.fill(1e-3);
  step.smallestLogScale = -3.0, step.largestLogScale = 3.0;
  for (PaperOptimiser* optimiser : {all.get(), visited.get()}) {
    optimiser->put(fewEllipsoids());
    for (std::size_t s = 0; s < optimiser->subvolumeCount(); ++s) optimiser->iterate(s, step);
  }
  EXPECT_EQ(all->measure().squaredSum, visited->measure().squaredSum);
  EXPECT_EQ(all->gradients(kSubvolume).byEllipsoid, visited->gradients(kSubvolume).byEllipsoid);
}

ESVR_ON_DEVICES(PaperGradientOn);

TEST(PaperEllipsoid, IsTheSameFunctionInBothForms) {
  for (const KernelKind kind :
       {KernelKind{}, KernelKind{.gaussian = true}, KernelKind{.learnK = true}})
    for (const PaperEllipsoid& p : fewEllipsoids().ellipsoids) {
      const Ellipsoid unit = ellipsoidOf(p, kind);
      const auto kernel =
          kernelConstants<double>(kernelOf(kind), kind.learnK ? p.k : double(kernelOf(kind).kappa));
      for (const Coord v : {Coord{11, 12, 10}, Coord{9, 11, 12}, Coord{8, 14, 9}}) {
        const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
        double m = 0.0;
        for (int r = 0; r < 3; ++r)
          m += std::pow(unit.L[3 * r] * d[0] + unit.L[3 * r + 1] * d[1] + unit.L[3 * r + 2] * d[2],
                        2);
        EXPECT_NEAR(kernelPhi(kernel, m),
                    kernelAt(squaredDistance(p, v), kind.learnK ? p.k : kind.k, kind.gaussian),
                    1e-12);
      }
    }
}

}  // namespace
}  // namespace esvr::paper
