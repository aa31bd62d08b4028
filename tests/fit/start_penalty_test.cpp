// Plan: the gradient of the penalty is the derivative of its definition by a step, found by
// differences in float64. Ellipsoids without a start have none.

#include "fit/start_penalty.h"

#include <gtest/gtest.h>

namespace esvr {
namespace {

constexpr double kWeight = 0.3, kPhi2 = 7.0, kSmallShare = 1e-3;

Ellipsoid someEllipsoid() {
  return {{1.0, -2.0, 3.0}, {0.5, 0.1, -0.2, 0.05, 0.8, 0.3, 0.0, -0.1, 1.4}, 0.7};
}

/// An ellipsoid that is a step away from another one.
Ellipsoid steppedFrom(Ellipsoid p, const ParameterVector& step) {
  applyStep(p, step);
  return p;
}

/// The penalty by its definition, with the factors of `factors`.
double penaltyOf(const Ellipsoid& p, const Ellipsoid& start, const Ellipsoid& factors) {
  using namespace ellipsoid_math;
  const Matrix3d L = asEigen(p.L), L0 = asEigen(start.L);
  const Matrix3d change = Matrix3d::Identity() - L * L0.inverse();
  const Matrix3d deformation = 0.5 * (change + change.transpose());
  Eigen::Vector3d moved;
  for (int a = 0; a < 3; ++a) moved[a] = p.center[std::size_t(a)] - start.center[std::size_t(a)];
  const double square = factors.intensity * factors.intensity;
  const double intensity = p.intensity - start.intensity;
  return 0.5 * kWeight * kPhi2 *
         (square * (L * moved).squaredNorm() + square * deformation.squaredNorm() +
          intensity * intensity);
}

ParameterVector penaltyGradient(const Ellipsoid& p, const Ellipsoid& start) {
  EllipsoidGradient none{};
  none.phi2 = kPhi2;
  return penalised(none, p, 0, {&start, kWeight});
}

TEST(StartPenalty, GradientIsTheDerivativeOfTheDefinition) {
  const Ellipsoid start = someEllipsoid();
  ParameterVector away;
  for (int k = 0; k < kParameters; ++k) away[std::size_t(k)] = kSmallShare * (k % 3 - 1 + 0.3 * k);
  const Ellipsoid p = steppedFrom(start, away);
  const ParameterVector found = penaltyGradient(p, start);
  constexpr double h = 1e-6;
  for (int k = 0; k < kParameters; ++k) {
    ParameterVector up{}, down{};
    up[std::size_t(k)] = h, down[std::size_t(k)] = -h;
    // L appears in the displacement too, so that shapes are compared with the center at the start.
    Ellipsoid from = p;
    if (k >= 3 && k < 9) from.center = start.center;
    const double expected = (penaltyOf(steppedFrom(from, up), start, p) -
                             penaltyOf(steppedFrom(from, down), start, p)) /
                            (2 * h);
    // The formula is of the first order, and the steps are up to four thousandths: the largest
    // component, 0.007, is wrong by some thousandths of itself.
    EXPECT_NEAR(found[std::size_t(k)], expected, 0.03 * kWeight * kPhi2 * kSmallShare) << k;
  }
}

TEST(StartPenalty, IsNoneAtTheStartAndWithoutOne) {
  const Ellipsoid start = someEllipsoid();
  for (const double g : penaltyGradient(start, start)) EXPECT_NEAR(g, 0.0, 1e-15);
  EllipsoidGradient gradient{};
  gradient.phi2 = kPhi2;
  gradient.byParameter.fill(2.0);
  Ellipsoid moved = start;
  moved.center[0] += 1.0;
  EXPECT_EQ(penalised(gradient, moved, kNoStart, {&start, kWeight}), gradient.byParameter);
  EXPECT_EQ(penalised(gradient, moved, 0, {}), gradient.byParameter);
  EXPECT_NE(penalised(gradient, moved, 0, {&start, kWeight}), gradient.byParameter);
}

}  // namespace
}  // namespace esvr
