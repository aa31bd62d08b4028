// Plan: gradients, loss and curvature of the GPU agree with those of the CPU, which other tests
// compare with float64 differences. The cases are kernels from soft to hard, thin ellipsoids,
// ellipsoids that cover everything, narrow bands, bricks that only supports reach, and many
// ellipsoids in one brick. For the shapes and kernels of the CPU's tests (gradient_test.cpp), the
// gradients are compared with float64 differences and the adjoint identity.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fit/cpu/cpu_pass.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/gpu_test.h"
#include "fit/gradient_cases.h"
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

}  // namespace
}  // namespace esvr
