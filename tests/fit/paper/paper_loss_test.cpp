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

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "field/random_field.h"
#include "fit/paper/paper_loss.h"
#include "fit/paper/paper_loss_scene.h"
#include "support/on_threads.h"

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
