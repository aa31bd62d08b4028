// Plan: the gradients of 1/2 sum r^2 by every parameter of every ellipsoid and by kappa are
// compared with central differences of a float64 sum over all voxels of a dense box. This is done
// for a random field, including bricks that only supports reach, and for ellipsoids of every shape
// and kernel (device_cases.h). For these shapes the adjoint identity <g, dV> = <dL, dtheta> is
// checked for a random g: the residual of a random target, as in the default fit, and a given g, as
// in the paper's method.
//
// The tests of intensities (device_cases.h) run on the CPU; the bits do not depend on the number of threads.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/adam.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/device_cases.h"
#include "fit/ellipsoid.h"
#include "fit/gradient_scene.h"

namespace esvr {
namespace {

using test::denseVolume;
using test::kSide;
using test::randomEllipsoids;
using test::sumAt;

/// 1/2 sum r^2 in float64 over a box that contains every support. If the target saturates, sums are clamped to its range.
/// Beyond an end of the range, the loss goes on as a line, whose slope is `slopeBeyond` times the slope at the end.
class ReferenceLoss {
 public:
  ReferenceLoss(const SparseVolume& volume, const FitTarget& target) : target_(target) {
    constexpr int kMargin = 14;
    for (int x = -kMargin; x < kSide + kMargin; ++x)
      for (int y = -kMargin; y < kSide + kMargin; ++y)
        for (int z = -kMargin; z < kSide + kMargin; ++z) voxels_.push_back({x, y, z});
    for (const Coord v : voxels_)
      values_.push_back(double(esvr::valueAt(volume, v)) * target.scale);
  }

  /// The sum of ellipsoids at each voxel.
  [[nodiscard]] std::vector<double> sums(const std::vector<Ellipsoid>& ellipsoids,
                                         const KernelConstants<double>& k) const {
    std::vector<double> all;
    all.reserve(voxels_.size());
    for (const Coord v : voxels_) all.push_back(sumAt(ellipsoids, k, v));
    return all;
  }

  /// The loss of the sum of two parts, so that what does not change is evaluated once.
  [[nodiscard]] double of(const std::vector<double>& part, const std::vector<double>& rest,
                          double slopeBeyond = 1.0) const {
    double loss = 0.0;
    for (std::size_t v = 0; v < part.size(); ++v) {
      const double sum = part[v] + rest[v];
      const double clamped =
          target_.saturates ? std::clamp(sum, target_.lowest, target_.highest) : sum;
      const double r = clamped - values_[v];
      loss += 0.5 * r * r + slopeBeyond * r * (sum - clamped);
    }
    return loss;
  }
  [[nodiscard]] double of(const std::vector<double>& sum, double slopeBeyond = 1.0) const {
    return of(sum, std::vector<double>(sum.size()), slopeBeyond);
  }

 private:
  const FitTarget& target_;
  std::vector<Coord> voxels_;
  std::vector<double> values_;
};

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
  const ReferenceLoss reference(volume, target);
  EXPECT_NEAR(0.5 * loss, reference.of(reference.sums(ellipsoids, k), 0.0), 1e-5 * loss);

  constexpr double kStep = 1e-6;
  for (std::size_t i = 0; i < ellipsoids.size(); ++i) {
    auto others = ellipsoids;
    others.erase(others.begin() + std::ptrdiff_t(i));
    const auto rest = reference.sums(others, k);
    double error2 = 0.0, norm2 = 0.0;
    for (int parameter = 0; parameter < kParameters; ++parameter) {
      const auto lossAt = [&](double step) {
        Ellipsoid moved = ellipsoids[i];
        ParameterVector s{};
        s[parameter] = step;
        applyStep(moved, s);
        return reference.of(reference.sums({moved}, k), rest);
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

  const ReferenceLoss reference(volume, target);
  constexpr double kStep = 1e-6;
  const auto lossAt = [&](double step) {
    const auto moved = kernelConstants<double>(kernel, double(kernel.kappa) + step);
    auto scaled = ellipsoids;
    for (Ellipsoid& p : scaled) shrinkBy(p, std::sqrt(kernelWidth(moved).m / kernelWidth(k).m));
    return reference.of(reference.sums(scaled, moved));
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
    CpuPass pass(target_.get(), kernel_);
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

// ---- Intensities

using test::Intensities;
INSTANTIATE_TEST_SUITE_P(Cpu, Intensities, testing::Values("cpu"));

TEST(IntensityProblem, GivesTheSameBitsOnAnyNumberOfThreads) {
  const Field field = test::someField();
  const SparseVolume volume = test::tubeVolume();
  const IntensityTarget target = test::targetOf(volume);
  test::expectSameOnAnyThreads([&] {
    std::vector<float> intensities(field.ellipsoidCount(), 0.2f);
    IntensityProblem problem(target);
    problem.setShapes(field);
    (void)problem.solve(intensities, 10);
    return intensities;
  });
}

}  // namespace
}  // namespace esvr
