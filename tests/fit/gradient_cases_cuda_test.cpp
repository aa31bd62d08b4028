// Plan: the gradients of a GPU are compared with float64 differences and the adjoint identity, for
// the shapes and kernels of the CPU's tests (gradient_test.cpp).

#include "cuda/gpu_test.h"
#include "fit/cuda/cuda_optimiser.h"
#include "gradient_cases.h"

namespace esvr {
namespace {

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
