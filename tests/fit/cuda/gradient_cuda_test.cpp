// Plan: gradients, loss and curvature of the GPU agree with those of the CPU, which other tests
// compare with float64 differences. The cases are kernels from soft to hard, thin ellipsoids,
// ellipsoids that cover everything, narrow bands, bricks that only supports reach, and many
// ellipsoids in one brick. For the shapes and kernels of the CPU's tests (gradient_test.cpp), the
// gradients are compared with float64 differences and the adjoint identity.
//
// The tests of device_cases.h run on a GPU. Passes over many overlapping ellipsoids agree
// with those of the CPU, and have the same bits in every run.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fit/cpu/cpu_pass.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/device_cases.h"
#include "fit/gradient_scene.h"
#include "fit/volumes.h"

namespace esvr {
namespace {

struct Case {
  const char* name;
  float kappa;
  std::size_t count;
  double smallest, aspect;
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

double distance(const ParameterVector& a, const ParameterVector& b) {
  double sum = 0.0;
  for (int k = 0; k < kParameters; ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum);
}

/// A box that contains the support of an ellipsoid.
Box supportBox(const Ellipsoid& p, const KernelConstants<double>& k) {
  const Matrix3 F = inverse(p.L);
  std::array<int, 3> low, high;
  for (std::size_t a = 0; a < 3; ++a) {
    const double half = supportRadius(k) * std::hypot(F[3 * a], F[3 * a + 1], F[3 * a + 2]);
    low[a] = int(std::floor(p.center[a] - half)), high[a] = int(std::ceil(p.center[a] + half));
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

/// The volume, the kernel and the ellipsoids of a case.
struct GradientScene {
  const SparseVolume& volume;
  FitTarget target;
  Kernel kernel;
  std::vector<Ellipsoid> ellipsoids;

  [[nodiscard]] KernelConstants<double> constants() const {
    return kernelConstants<double>(kernel);
  }
  [[nodiscard]] double residual(Coord v) const {
    const double value = double(valueAt(volume, v)) - volume.background;
    return test::sumAt(ellipsoids, constants(), v) - value * target.scale;
  }
};

/// The change of an ellipsoid's gradient if all voxels at the end of its support count as outside.
/// Rounding decides on which side of the end they are, so that devices may differ. There phi is 0,
/// but its slope is not.
double gradientAtTheEnd(const GradientScene& scene, const Ellipsoid& p) {
  constexpr double kRounding = 3e-5;  // relative to m; needles lose the most digits of it
  const auto k = scene.constants();
  const double m = k.cutoff;
  const double slope = k.base * (1.0 - k.base * k.slope);
  const double byParameters = 2.0 * std::sqrt(m) + 2.0 * std::sqrt(2.0) * m;  // a bound of |dm|
  const Box box = supportBox(p, k);
  double change = 0.0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        if (std::abs(test::squaredDistance(p, {x, y, z}) - m) < kRounding * m)
          change += std::abs(scene.residual({x, y, z})) * slope * byParameters;
  return change;
}

/// Compares all gradients. The tolerance is relative to the largest one, because residuals nearly
/// cancel in some.
void expectAgreement(const GradientScene& scene, double tolerance) {
  const auto& [volume, target, kernel, ellipsoids] = scene;
  CpuPass engine(target, kernelConstants<double>(kernel));
  engine.rebuild(ellipsoids, 0.5);
  std::vector<EllipsoidGradient> expected(ellipsoids.size());
  const double loss = engine.gradients(ellipsoids, expected);

  OptimiserOptions options;
  options.kernel = kernel;
  cuda::CudaOptimiser onGpu(target, options, {});
  onGpu.setEllipsoids(ellipsoids);
  const auto found = onGpu.gradients();
  ASSERT_EQ(found.size(), expected.size());
  double largest = 0.0, largestPhi2 = 0.0, largestByKappa = 0.0;
  for (const auto& g : expected) {
    largest = std::max(largest, distance(g.byParameter, {}));
    largestPhi2 = std::max(largestPhi2, g.phi2);
    largestByKappa = std::max(largestByKappa, std::abs(g.byKappa));
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double off = distance(found[i].byParameter, expected[i].byParameter);
    const double atTheEnd =
        off < tolerance * largest ? 0.0 : gradientAtTheEnd(scene, ellipsoids[i]);
    EXPECT_LT(off, tolerance * largest + atTheEnd) << i;
    EXPECT_NEAR(found[i].byParameter[9], expected[i].byParameter[9], tolerance * largest) << i;
    EXPECT_NEAR(found[i].phi2, expected[i].phi2, tolerance * largestPhi2) << i;
    // byKappa is the difference of two sums of the size of the other gradients.
    EXPECT_NEAR(found[i].byKappa, expected[i].byKappa,
                tolerance * (largestByKappa + largest) + atTheEnd)
        << i;
  }
  EXPECT_NEAR(onGpu.measure().squaredSum, loss, 1e-5 * loss);
}

class GradientOnGpu : public test::CudaTest, public testing::WithParamInterface<Case> {};

// Both sides are float32 sums over a few thousand voxels, with exponentials precise to 1e-6, whose
// errors cancel in part.
TEST_P(GradientOnGpu, AgreesWithTheCpu) {
  const Case& c = GetParam();
  const SparseVolume volume = test::denseVolume();
  expectAgreement({volume,
                   makeTarget(volume, std::nullopt),
                   {.kappa = c.kappa},
                   test::randomEllipsoids(c.count, c.smallest, c.aspect)},
                  5e-6);
}
INSTANTIATE_TEST_SUITE_P(
    Cases, GradientOnGpu,
    testing::Values(Case{"gaussian", -30.0f, 20, 1.5, 2.0}, Case{"soft", -3.0f, 20, 1.5, 2.0},
                    Case{"usual", 2.0f, 200, 0.5, 4.0}, Case{"paper", 5.0f, 200, 0.5, 4.0},
                    Case{"hard", 60.0f, 50, 1.5, 2.0}, Case{"needles", 2.0f, 50, 0.3, 300.0},
                    Case{"subvoxel", 2.0f, 200, 0.1, 2.0}, Case{"huge", 2.0f, 5, 20.0, 2.0},
                    Case{"crowd", 2.0f, 5000, 0.5, 4.0}));

class SaturationOnGpu : public test::CudaTest, public testing::WithParamInterface<bool> {};

// Ellipsoids of both signs lead beyond both ends of the range, also in bricks without a target.
TEST_P(SaturationOnGpu, IsThatOfTheCpu) {
  const SparseVolume volume = test::levelSetVolume();
  FitTarget target = makeTarget(volume, std::nullopt);
  target.saturates = true;
  target.narrowBand = GetParam();
  expectAgreement({volume, target, {.kappa = 2.0f}, test::randomEllipsoids(100, 1.0, 3.0)}, 1e-4);
}
INSTANTIATE_TEST_SUITE_P(Bricks, SaturationOnGpu, testing::Bool(), [](const auto& narrowBand) {
  return narrowBand.param ? "OfANarrowBand" : "ThatSupportsReach";
});

// The constants may move a sum beyond the range of the target.
TEST_P(SaturationOnGpu, IsThatOfTheCpuWithConstants) {
  const SparseVolume volume = test::levelSetVolume();
  FitTarget target = makeTarget(volume, std::nullopt);
  target.saturates = true;
  target.narrowBand = GetParam();
  test::Random random(13);
  target.constants.resize(target.values.size());
  for (float& v : target.constants) v = float(random(-0.5, 0.5));
  expectAgreement({volume, target, {.kappa = 2.0f}, test::randomEllipsoids(100, 1.0, 3.0)}, 1e-4);
}

class GradientCasesOnGpu : public test::CudaTest,
                           public testing::WithParamInterface<test::GradientCase> {
 protected:
  [[nodiscard]] std::vector<EllipsoidGradient> gradients() const {
    OptimiserOptions options;
    options.kernel = {.kappa = GetParam().kappa};
    cuda::CudaOptimiser onGpu(target_.get(), options, {});
    onGpu.setEllipsoids(ellipsoids_);
    return onGpu.gradients();
  }

  const test::SmallTarget target_;
  const std::vector<Ellipsoid> ellipsoids_ = test::ellipsoidsOf(GetParam(), target_);
};

TEST_P(GradientCasesOnGpu, AgreeWithDifferences) {
  const auto g = test::residualsOf(target_, GetParam(), ellipsoids_);
  test::expectDifferences(target_, GetParam(), ellipsoids_, g, gradients());
}

TEST_P(GradientCasesOnGpu, SatisfyTheAdjointIdentity) {
  const auto g = test::residualsOf(target_, GetParam(), ellipsoids_);
  test::expectAdjointIdentity(target_, GetParam(), ellipsoids_, g, gradients());
}

INSTANTIATE_TEST_SUITE_P(All, GradientCasesOnGpu, testing::ValuesIn(test::gradientCases()),
                         [](const auto& c) { return test::nameOf(c.param); });

// ---- Intensities

using test::Intensities;
INSTANTIATE_TEST_SUITE_P(Cuda, Intensities, testing::Values("cuda"));

class IntensitiesOnGpu : public test::CudaTest {};

struct Crowd {
  SparseVolume volume = test::tubeVolume();
  Field field = test::randomField(
      {.count = 3000, .extent = 40.0, .smallest = 0.5, .aspect = 4.0, .origin = {0, 0, 0}});
  test::ReaderRule rule;
  IntensityTarget target{volume, rule.rule, activeBox(volume)};
};

double largestOf(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double v : values) largest = std::max(largest, std::abs(v));
  return largest;
}

void expectNear(const std::vector<double>& found, const std::vector<double>& expected,
                double tolerance) {
  ASSERT_EQ(found.size(), expected.size());
  const double allowed = tolerance * largestOf(expected);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], allowed) << i;
}

// Both sides are float32 sums over some hundred ellipsoids per voxel. On the GPU the unit of the
// sums is 2^-29 of their largest value. A voxel at the threshold that is exact on one side only
// would change the result by 1e-3.
TEST_F(IntensitiesOnGpu, AreMovedAsOnTheCpu) {
  const Crowd crowd;
  const auto cpu = makeIntensityPasses(crowd.target, {});
  const auto gpu = makeIntensityPasses(crowd.target, device_);
  cpu->setShapes(crowd.field);
  gpu->setShapes(crowd.field);
  std::vector<float> intensities(crowd.field.ellipsoidCount(), 0.01f);
  IntensityGradient expected, found;
  const StoredError error = cpu->gradient(intensities, expected);
  EXPECT_NEAR(gpu->gradient(intensities, found).squares, error.squares, 1e-4 * error.squares);
  EXPECT_NEAR(gpu->error(intensities).largest, error.largest, 1e-4);
  expectNear(found.byIntensity, expected.byIntensity, 1e-4);
  expectNear(found.curvature, expected.curvature, 1e-5);
  std::vector<double> normal, normalOnGpu;
  cpu->applyNormal(expected.byIntensity, normal);
  gpu->applyNormal(expected.byIntensity, normalOnGpu);
  expectNear(normalOnGpu, normal, 1e-4);
}

TEST_F(IntensitiesOnGpu, AreTheSameBitsInEveryRun) {
  const Crowd crowd;
  std::vector<std::vector<float>> runs;
  for (int run = 0; run < 3; ++run) {
    IntensityProblem problem(crowd.target, device_);
    problem.setShapes(crowd.field);
    runs.emplace_back(crowd.field.ellipsoidCount(), 0.01f);
    (void)problem.solve(runs.back(), 6);
  }
  EXPECT_EQ(runs[1], runs[0]);
  EXPECT_EQ(runs[2], runs[0]);
}

TEST_F(IntensitiesOnGpu, RefuseEllipsoidsThatReachTooManyBricks) {
  Crowd crowd;
  const auto passes = makeIntensityPasses(crowd.target, device_);
  // The bricks of 3 e^14 voxels, cubed, still have a number in 64 bits; those of e^32 have none.
  for (const float logScale : {14.0f, 32.0f}) {
    for (auto& plane : crowd.field.chunks[0].ellipsoids.logScale) plane[0] = logScale;
    EXPECT_THROW(passes->setShapes(crowd.field), DeviceError) << logScale;
  }
}

TEST_F(IntensitiesOnGpu, TakeOneKappaForAll) {
  Crowd crowd;
  Ellipsoids& e = crowd.field.chunks[0].ellipsoids;
  e.kappa.assign(e.size(), 2.0f);
  const auto passes = makeIntensityPasses(crowd.target, device_);
  EXPECT_THROW(passes->setShapes(crowd.field), RuntimeFailure);
}

}  // namespace

}  // namespace esvr
