// Plan: gradients, loss and curvature of the GPU agree with those of the CPU, which other tests
// compare with float64 differences. The cases are kernels from soft to hard, thin ellipsoids,
// ellipsoids that cover everything, narrow bands, bricks that only supports reach, and many
// ellipsoids in one brick.

#include <cmath>

#include "../random_ellipsoids.h"
#include "../volumes.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/cuda/cuda_optimiser.h"
#include "gpu_test.h"

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

/// Compares all gradients. The tolerance is relative to the largest one, because residuals nearly
/// cancel in some.
void expectAgreement(const FitTarget& target, const Kernel& kernel,
                     const std::vector<Ellipsoid>& ellipsoids, double tolerance) {
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
    EXPECT_LT(distance(found[i].byParameter, expected[i].byParameter), tolerance * largest) << i;
    EXPECT_NEAR(found[i].phi2, expected[i].phi2, tolerance * largestPhi2) << i;
    // byKappa is the difference of two sums of the size of the other gradients.
    EXPECT_NEAR(found[i].byKappa, expected[i].byKappa, tolerance * (largestByKappa + largest)) << i;
  }
  EXPECT_NEAR(onGpu.measure().squaredSum, loss, 1e-5 * loss);
}

class GradientOnGpu : public test::CudaTest, public testing::WithParamInterface<Case> {};

// Both sides are float32 sums over a few thousand voxels, with exponentials precise to 1e-6.
TEST_P(GradientOnGpu, AgreesWithTheCpu) {
  const Case& c = GetParam();
  const SparseVolume volume = test::denseVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  expectAgreement(target, {.kappa = c.kappa}, test::randomEllipsoids(c.count, c.smallest, c.aspect),
                  1e-4);
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
  expectAgreement(target, {.kappa = 2.0f}, test::randomEllipsoids(100, 1.0, 3.0), 1e-4);
}
INSTANTIATE_TEST_SUITE_P(Bricks, SaturationOnGpu, testing::Bool(), [](const auto& narrowBand) {
  return narrowBand.param ? "OfANarrowBand" : "ThatSupportsReach";
});

}  // namespace
}  // namespace esvr
