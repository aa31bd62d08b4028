// Plan: the slope of the kernel is compared with differences in float64, and the largest slope of an
// interval with many slopes in it. If m is moved by any amount up to the bound of its error, phi must
// not change by more than its bound; this holds at the edge, at the end of the support, and for the
// paper's kernel, which jumps there. The bound of m is compared with float32 arithmetic.

#include "field/rounding_bound.h"

#include <gtest/gtest.h>

#include <cmath>

#include "field/line_math.h"
#include "field/random_field.h"

namespace esvr {
namespace {

struct KernelCase {
  float kappa;
  KernelForm form = KernelForm::kContinuous;
};

class RoundingBound : public testing::TestWithParam<KernelCase> {
 protected:
  const KernelConstants<double> kernel_ =
      kernelConstants<double>({.form = GetParam().form, .kappa = GetParam().kappa});
};

TEST_P(RoundingBound, HasTheSlopeOfTheKernel) {
  constexpr double kStep = 1e-6;
  for (int n = 1; n < 100; ++n) {
    const double m = n / 100.0 * kernel_.cutoff;
    const double difference =
        (kernelPhi(kernel_, m - kStep) - kernelPhi(kernel_, m + kStep)) / (2 * kStep);
    // Differences of values up to 1 with errors of 2^-53, and of m with an error of 2^-53 kappa.
    EXPECT_NEAR(rounding::slopeAt(kernel_, m), difference,
                1e-8 + 1e-9 * std::abs(GetParam().kappa));
  }
}

TEST_P(RoundingBound, HasTheSteepestSlopeOfAnInterval) {
  test::Random random(3);
  for (int n = 0; n < 100; ++n) {
    const double from = random(0.0, kernel_.cutoff), to = random(from, kernel_.cutoff);
    const double steepest = rounding::steepest(kernel_, from, to);
    for (int i = 0; i <= 50; ++i)
      EXPECT_LE(rounding::slopeAt(kernel_, from + i / 50.0 * (to - from)), steepest * (1 + 1e-12));
  }
}

TEST_P(RoundingBound, CoversEveryErrorOfM) {
  test::Random random(5);
  for (const double error : {1e-6, 1e-3, 0.1, 2.0})
    for (int n = 0; n < 200; ++n) {
      const double m = random(0.0, 1.1 * kernel_.cutoff + error);
      const double bound = rounding::ofPhi(kernel_, m, error);
      for (const double off : {-error, random(-error, error), error}) {
        const double moved = kernelPhi(kernel_, std::max(0.0, m + off));
        EXPECT_LE(std::abs(moved - kernelPhi(kernel_, m)), bound) << m << " by " << off;
      }
    }
}

TEST_P(RoundingBound, IsNothingOutsideTheSupport) {
  EXPECT_EQ(rounding::ofPhi(kernel_, 1.01 * kernel_.cutoff + 1.0, 1e-6), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Kernels, RoundingBound,
                         testing::Values(KernelCase{-30.0f}, KernelCase{0.0f}, KernelCase{2.0f},
                                         KernelCase{30.0f}, KernelCase{5000.0f},
                                         KernelCase{5.0f, KernelForm::kPaper},
                                         KernelCase{0.5f, KernelForm::kPaper}));

/// m of an ellipsoid at a voxel, in the float32 arithmetic of a line.
float squaredInFloat(const LineForm& f, Coord voxel) {
  const float dx = float(voxel.x) - f.center[0], dz = float(voxel.z) - f.center[2];
  const float pzDz[3] = {f.pz[0] * dz, f.pz[1] * dz, f.pz[2] * dz};
  const float t = distanceAlong(f, float(voxel.y), f.center[1], dx, dz);
  return squaredAt(f, closestSquared(f, dx, pzDz), t);
}

TEST(RoundingBoundOfM, CoversFloat32) {
  const Field field =
      test::randomField({.count = 200, .extent = 8.0, .smallest = 0.1, .aspect = 1000.0});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  double largestShare = 0.0;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const Matrix3 L = unitFrame(e, i);
    const std::array<double, 3> center{e.center[0][i], e.center[1][i], e.center[2][i]};
    const LineForm form = makeLineForm(center, L, 1.0, 1.0);
    for (const Coord voxel : {Coord{0, 0, 0}, Coord{7, 1, 3}, Coord{2, 6, 5}}) {
      const double d[3] = {voxel.x - center[0], voxel.y - center[1], voxel.z - center[2]};
      double m = 0.0;
      for (int r = 0; r < 3; ++r)
        m += std::pow(L[3 * r] * d[0] + L[3 * r + 1] * d[1] + L[3 * r + 2] * d[2], 2);
      const double bound = rounding::ofM(rounding::columnLengths(L), d, m);
      const double error = std::abs(double(squaredInFloat(form, voxel)) - m);
      EXPECT_LE(error, bound);
      largestShare = std::max(largestShare, error / bound);
    }
  }
  EXPECT_GT(largestShare, 1e-3) << "a bound that is much too large says nothing";
}

}  // namespace
}  // namespace esvr
