// Plan: if isHeld() is true, the whole support of an ellipsoid is inside its listed support, over
// random steps of many sizes. Growth by the slack is the largest growth that is held, and a move by
// the slack is the largest move. motionSince() is an upper bound of the slack that is needed. A
// step beyond the slack is refused. Young ellipsoids get the largest slack. optimiser_test.cpp
// tests fits whose ellipsoids move fast.

#include "fit/motion_bound.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../field/random_field.h"
#include "random_ellipsoids.h"

namespace esvr {
namespace {

using test::Random;

constexpr double kRadius = 2.5;

Ellipsoid roundEllipsoid(double scale) {
  return {{1, 2, 3}, {1 / scale, 0, 0, 0, 1 / scale, 0, 0, 0, 1 / scale}, 1.0};
}

ListedSupport listedAs(const Ellipsoid& p, double slack) {
  return {p.center, p.L, kRadius * (1.0 + slack), false};
}

/// The largest distance, in the listed unit frame, of points on the surface of p's support.
double farthest(const ListedSupport& listed, const Ellipsoid& p, Random& random) {
  const Matrix3 F = inverse(p.L);
  double largest = 0.0;
  for (int n = 0; n < 200; ++n) {
    std::array<double, 3> q{random(-1, 1), random(-1, 1), random(-1, 1)}, x{};
    const double length = std::hypot(q[0], q[1], q[2]);
    for (int r = 0; r < 3; ++r)
      x[r] = p.center[r] - listed.center[r] +
             kRadius / length * (F[3 * r] * q[0] + F[3 * r + 1] * q[1] + F[3 * r + 2] * q[2]);
    double square = 0.0;
    for (int r = 0; r < 3; ++r)
      square += std::pow(
          listed.L[3 * r] * x[0] + listed.L[3 * r + 1] * x[1] + listed.L[3 * r + 2] * x[2], 2);
    largest = std::max(largest, std::sqrt(square));
  }
  return largest;
}

TEST(MotionBound, WhatIsHeldLiesInsideWhatWasListed) {
  Random random(5);
  int held = 0, outgrown = 0;
  for (const Ellipsoid& start : test::randomEllipsoids(300, 0.3, 20.0)) {
    const ListedSupport listed = listedAs(start, 0.2);
    Ellipsoid p = start;
    for (int step = 0; step < 8; ++step) {
      ParameterVector s;
      for (double& value : s) value = 0.06 * random(-1, 1);
      applyStep(p, s);
      const double far = farthest(listed, p, random);
      if (isHeld(listed, p, kRadius)) {
        EXPECT_LE(far, listed.reach * (1 + 1e-12));
        ++held;
      } else {
        ++outgrown;
      }
      EXPECT_LE(far, kRadius * (1.0 + motionSince(listed, p, kRadius)) * (1 + 1e-12));
    }
  }
  EXPECT_GT(held, 200);
  EXPECT_GT(outgrown, 200);
}

TEST(MotionBound, GrowthAndMovesEndWithTheSlack) {
  for (const double scale : {0.2, 3.0, 16.0}) {
    const Ellipsoid start = roundEllipsoid(scale);
    const ListedSupport listed = listedAs(start, 0.2);
    EXPECT_TRUE(isHeld(listed, roundEllipsoid(1.199 * scale), kRadius));
    EXPECT_FALSE(isHeld(listed, roundEllipsoid(1.201 * scale), kRadius));
    Ellipsoid moved = start;
    moved.center[1] += 0.199 * kRadius * scale;
    EXPECT_TRUE(isHeld(listed, moved, kRadius));
    moved.center[1] += 0.002 * kRadius * scale;
    EXPECT_FALSE(isHeld(listed, moved, kRadius));
    EXPECT_NEAR(motionSince(listed, moved, kRadius), 0.201, 1e-9);
    EXPECT_NEAR(motionSince(listed, roundEllipsoid(1.5 * scale), kRadius), 0.5, 1e-9);
  }
}

TEST(MotionBound, AStepOutOfTheListsLeavesThePlaceAndTakesTheIntensity) {
  const Ellipsoid before = roundEllipsoid(2.0);
  ListedSupport listed = listedAs(before, 0.2);
  Ellipsoid inside = roundEllipsoid(2.1), outside = roundEllipsoid(3.0);
  outside.intensity = 0.5;
  EXPECT_FALSE(refuseStep(listed, kRadius, before, inside));
  EXPECT_EQ(inside.L, roundEllipsoid(2.1).L);
  EXPECT_FALSE(listed.refused);
  EXPECT_TRUE(refuseStep(listed, kRadius, before, outside));
  EXPECT_EQ(outside.center, before.center);
  EXPECT_EQ(outside.L, before.L);
  EXPECT_EQ(outside.intensity, 0.5);
  EXPECT_TRUE(listed.refused);
}

TEST(MotionBound, ARefusedStepIsNotRefusedAgain) {
  // With a hard edge the core is all of the support. This ellipsoid has not moved so far, so that
  // its slack is that of minSlack, which is less than a step.
  const SlackRule rule;
  const Ellipsoid before = roundEllipsoid(20.0), after = roundEllipsoid(22.0);
  ListedSupport listed = listedSupport(before, 100, listedAs(before, 0.1), kRadius, rule);
  Ellipsoid p = after;
  ASSERT_TRUE(refuseStep(listed, kRadius, before, p));
  listed = listedSupport(before, 101, listed, kRadius, rule);
  p = after;
  EXPECT_FALSE(refuseStep(listed, kRadius, before, p));
}

TEST(MotionBound, ListsEndWithAShareOfRefusedSteps) {
  const SlackRule rule{.refusedShare = 0.03};
  EXPECT_EQ(rule.refusedSteps(20), 1u);  // few ellipsoids: the first one
  EXPECT_EQ(rule.refusedSteps(1000), 31u);
}

TEST(MotionBound, WhatIsNotFiniteIsNotHeld) {
  Ellipsoid p = roundEllipsoid(1.0);
  const ListedSupport listed = listedAs(p, 0.2);
  p.center[0] = std::nan("");
  EXPECT_FALSE(isHeld(listed, p, kRadius));
  p = roundEllipsoid(1.0);
  p.L[4] = std::nan("");
  EXPECT_FALSE(isHeld(listed, p, kRadius));
}

TEST(MotionBound, TheCoreEndsWherePhiIsTheShare) {
  for (const float kappa : {-30.0f, 0.5f, 5.0f, 60.0f}) {
    const auto k = kernelConstants<double>({.kappa = kappa});
    for (const double share : {0.001, 0.05, 0.5})
      EXPECT_NEAR(kernelPhi(k, std::pow(coreRadius(k, share), 2)), share, 1e-9);
    EXPECT_NEAR(coreRadius(k, 0.0), supportRadius(k), 1e-9);
  }
}

TEST(MotionBound, SlackFollowsTheMotionBefore) {
  const SlackRule rule{.missedShare = 0.05,
                       .minSlack = 0.2,
                       .maxSlack = 0.3,
                       .slackOverMotion = 1.0,
                       .settledSteps = 4};
  const Ellipsoid p = roundEllipsoid(2.0);
  const double least = 0.2 / (2.0 * kRadius);
  EXPECT_EQ(slackOf(p, 3, {}, kRadius, rule), rule.maxSlack);
  EXPECT_NEAR(slackOf(p, 4, listedAs(p, 0.1), kRadius, rule), least, 1e-12);
  EXPECT_NEAR(slackOf(roundEllipsoid(2.4), 4, listedAs(p, 0.1), kRadius, rule), 0.2, 1e-9);
  EXPECT_EQ(slackOf(roundEllipsoid(4.0), 4, listedAs(p, 0.1), kRadius, rule), rule.maxSlack);
  // The ellipsoid is so small that minSlack is the larger of the two.
  EXPECT_NEAR(slackOf(roundEllipsoid(0.2), 3, {}, kRadius, rule), 0.4, 1e-12);
}

}  // namespace
}  // namespace esvr
