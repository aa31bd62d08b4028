// Plan: the gradients of 1/2 sum r^2 by every parameter of every ellipsoid and by kappa are
// compared with central differences of a float64 sum over all voxels of a dense box. This is done
// for a random field, including bricks that only supports reach, and for ellipsoids of every shape
// and kernel (gradient_cases.h). For these shapes the adjoint identity <g, dV> = <dL, dtheta> is
// checked for a random g, in the pass of the default fit, where g is the residual of a random
// target, and in the pass of the paper's method, whose input is g. The gradients at an offset are
// those of a volume that was moved in float64.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/cpu/cpu_pass.h"
#include "fit/ellipsoid_math.h"
#include "fit/paper/cpu_paper_pass.h"
#include "fit/parameter_gradient.h"
#include "gradient_cases.h"
#include "interpolate.h"
#include "random_ellipsoids.h"

namespace esvr {
namespace {

using test::denseVolume;
using test::kSide;
using test::randomEllipsoids;

double valueAt(const std::vector<Ellipsoid>& ellipsoids, const KernelConstants<double>& k,
               Coord v) {
  double value = 0.0;
  for (const Ellipsoid& p : ellipsoids) {
    const double d[3] = {v.x - p.center[0], v.y - p.center[1], v.z - p.center[2]};
    double m = 0.0;
    for (int r = 0; r < 3; ++r) {
      const double u = p.L[3 * r] * d[0] + p.L[3 * r + 1] * d[1] + p.L[3 * r + 2] * d[2];
      m += u * u;
    }
    value += p.intensity * kernelPhi(k, m);
  }
  return value;
}

/// 1/2 sum r^2 in float64 over a box that contains every support. If the target saturates, a sum
/// beyond the range has the loss of the range's end, plus its distance from that end times the
/// slope of the loss there times `slopeBeyond`.
double referenceLoss(const std::vector<Ellipsoid>& ellipsoids, const KernelConstants<double>& k,
                     const SparseVolume& volume, const FitTarget& target, int margin,
                     double slopeBeyond = 1.0) {
  double loss = 0.0;
  for (int x = -margin; x < kSide + margin; ++x)
    for (int y = -margin; y < kSide + margin; ++y)
      for (int z = -margin; z < kSide + margin; ++z) {
        const double t = double(esvr::valueAt(volume, {x, y, z})) * target.scale;
        const double sum = valueAt(ellipsoids, k, {x, y, z});
        const double clamped =
            target.saturates ? std::clamp(sum, target.lowest, target.highest) : sum;
        const double r = clamped - t;
        loss += 0.5 * r * r + slopeBeyond * r * (sum - clamped);
      }
  return loss;
}

class GradientKappa : public testing::TestWithParam<float> {
 protected:
  void expectCentralDifferences(bool saturates) const;
};

// The loss is about 1e4 in float64, so differences with a step of 1e-6 have errors near 1e-6. The
// step is so small because phi has a kink at the end of its support, and few voxels should lie
// across it. The gradient itself is a float32 sum over a few thousand voxels.
void GradientKappa::expectCentralDifferences(bool saturates) const {
  const SparseVolume volume = denseVolume();
  FitTarget target = makeTarget(volume, std::nullopt);
  target.saturates = saturates;
  const auto k = kernelConstants<double>({.kappa = GetParam()});
  const auto ellipsoids = randomEllipsoids(3, 1.5, 2.0);
  CpuPass engine(target, k);
  engine.rebuild(ellipsoids, 0.1);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  const double loss = engine.gradients(ellipsoids, gradients);
  EXPECT_NEAR(0.5 * loss, referenceLoss(ellipsoids, k, volume, target, 14, 0.0), 1e-5 * loss);

  constexpr double kStep = 1e-6;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    double error2 = 0.0, norm2 = 0.0;
    for (int parameter = 0; parameter < kParameters; ++parameter) {
      const auto lossAt = [&](double step) {
        auto moved = ellipsoids;
        ParameterVector s{};
        s[parameter] = step;
        applyStep(moved[i], s);
        return referenceLoss(moved, k, volume, target, 14);
      };
      const double difference = (lossAt(kStep) - lossAt(-kStep)) / (2 * kStep);
      error2 += std::pow(difference - gradients[i].byParameter[parameter], 2);
      norm2 += difference * difference;
    }
    EXPECT_LT(std::sqrt(error2), 3e-4 * std::sqrt(norm2)) << "ellipsoid " << i;
  }
}
TEST_P(GradientKappa, SlowAgreesWithCentralDifferences) { expectCentralDifferences(false); }
// Where a sum is clamped, the gradient is that of a loss that goes on linearly.
TEST_P(GradientKappa, SlowAgreesWithCentralDifferencesOfClampedSums) {
  expectCentralDifferences(true);
}

// The derivative by kappa is taken at fixed half widths: the scales change as in a run.
TEST_P(GradientKappa, AgreesWithCentralDifferencesByKappa) {
  const SparseVolume volume = denseVolume();
  const FitTarget target = makeTarget(volume, std::nullopt);
  const Kernel kernel{.kappa = GetParam()};
  const auto k = kernelConstants<double>(kernel);
  const auto ellipsoids = randomEllipsoids(3, 1.5, 2.0);
  CpuPass engine(target, k);
  engine.rebuild(ellipsoids, 0.1);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  engine.gradients(ellipsoids, gradients);

  constexpr double kStep = 1e-6;
  const auto lossAt = [&](double step) {
    const auto moved = kernelConstants<double>(kernel, double(kernel.kappa) + step);
    auto scaled = ellipsoids;
    for (Ellipsoid& p : scaled) shrinkBy(p, std::sqrt(kernelWidth(moved).m / kernelWidth(k).m));
    return referenceLoss(scaled, moved, volume, target, 14);
  };
  const double difference = (lossAt(kStep) - lossAt(-kStep)) / (2 * kStep);
  double slope = 0.0, terms = 0.0;
  for (const EllipsoidGradient& g : gradients) {
    slope += edgeGradient(g, kernelWidth(k).logMByKappa);
    for (int j = 3; j < 6; ++j) terms += std::abs(g.byParameter[j]);
  }
  // The precision of sums is as above. For a Gaussian the slope is nothing compared with the
  // rounding of the loss.
  EXPECT_NEAR(slope, difference, 3e-4 * std::max(terms * kernelWidth(k).logMByKappa, 1.0));
}

/// The target at an offset by interpolation in float64. Beyond the bricks next to those of the
/// volume it is 0.
FitTarget movedTarget(const SparseVolume& volume, const FitTarget& target, const Offset& offset) {
  FitTarget moved = target;
  moved.bricks.clear();
  moved.values.clear();
  const auto at = [&](Coord v) { return double(esvr::valueAt(volume, v)) * target.scale; };
  for (int x = -1; x <= kSide / kBrickSide; ++x)
    for (int y = -1; y <= kSide / kBrickSide; ++y)
      for (int z = -1; z <= kSide / kBrickSide; ++z) {
        moved.bricks.push_back({x, y, z});
        for (int v = 0; v < kBrickVoxels; ++v)
          moved.values.push_back(
              float(test::interpolate(offset, Coord{x, y, z} * kBrickSide + voxelLocal(v), at)));
      }
  return moved;
}

// A pass at an offset is the pass at the voxels for a moved target and moved ellipsoids. Both sides
// are float32 sums over the same few thousand voxels.
TEST_P(GradientKappa, AtAnOffsetIsThatOfAMovedVolume) {
  const SparseVolume volume = denseVolume();
  FitTarget target = makeTarget(volume, std::nullopt);
  target.saturates = true;
  const auto k = kernelConstants<double>({.kappa = GetParam()});
  const auto ellipsoids = randomEllipsoids(3, 1.5, 2.0);
  for (const Offset& offset : {Offset{0.3, -0.4, 0.1}, Offset{-0.2, 0.5, -0.5}}) {
    CpuPass pass(target, k);
    pass.rebuild(ellipsoids, 0.1 + kMaxOffset);
    pass.setOffset(offset);
    std::vector<EllipsoidGradient> found(ellipsoids.size()), expected(ellipsoids.size());
    pass.gradients(ellipsoids, found);

    const FitTarget moved = movedTarget(volume, target, offset);
    auto back = ellipsoids;
    for (Ellipsoid& p : back) p.center = movedBack(p.center, offset);
    CpuPass reference(moved, k);
    reference.rebuild(back, 0.1);
    reference.gradients(back, expected);
    for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
      double largest = 0.0;
      for (const double g : expected[i].byParameter) largest = std::max(largest, std::abs(g));
      for (int n = 0; n < kParameters; ++n)
        EXPECT_NEAR(found[i].byParameter[n], expected[i].byParameter[n], 1e-4 * largest)
            << "ellipsoid " << i << ", parameter " << n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, GradientKappa, testing::Values(-30.f, -3.f, 2.f, 5.f));

class GradientCases : public testing::TestWithParam<test::GradientCase> {
 protected:
  [[nodiscard]] std::vector<EllipsoidGradient> gradients() const {
    CpuPass pass(target_.get(), kernel_);
    pass.rebuild(ellipsoids_, 0.1);
    std::vector<EllipsoidGradient> found(ellipsoids_.size());
    pass.gradients(ellipsoids_, found);
    return found;
  }
  [[nodiscard]] std::vector<EllipsoidGradient> gradientsOf(const std::vector<double>& g) const {
    const paper::PopulationKernels kernels{{kernelConstants<float>({.kappa = GetParam().kappa})},
                                           {supportRadius(kernel_)}};
    paper::CpuPaperPass pass(target_.get(), kernels);
    pass.rebuild(ellipsoids_, 0.1);
    std::vector<EllipsoidGradient> found(ellipsoids_.size());
    pass.gradients(ellipsoids_, std::vector<float>(g.begin(), g.end()), found);
    return found;
  }

  const test::SmallTarget target_;
  const std::vector<Ellipsoid> ellipsoids_ = test::ellipsoidsOf(GetParam(), target_);
  const KernelConstants<double> kernel_ = kernelConstants<double>({.kappa = GetParam().kappa});
};

TEST_P(GradientCases, AgreeWithDifferences) {
  const auto g = test::residualsOf(target_, GetParam(), ellipsoids_);
  test::expectDifferences(target_, GetParam(), ellipsoids_, g, gradients());
}

TEST_P(GradientCases, SatisfyTheAdjointIdentity) {
  const auto g = test::residualsOf(target_, GetParam(), ellipsoids_);
  test::expectAdjointIdentity(target_, GetParam(), ellipsoids_, g, gradients());
}

TEST_P(GradientCases, OfAGivenDerivativeSatisfyTheAdjointIdentity) {
  test::Random random(13);
  std::vector<double> g(target_.get().values.size());
  for (double& v : g) v = double(float(random(-1.0, 1.0)));
  test::expectAdjointIdentity(target_, GetParam(), ellipsoids_, g, gradientsOf(g));
}

INSTANTIATE_TEST_SUITE_P(All, GradientCases, testing::ValuesIn(test::gradientCases()),
                         [](const auto& c) { return test::nameOf(c.param); });

}  // namespace
}  // namespace esvr
