// Plan: steps move and scale the semi-axes as ellipsoid.h states, and limits hold. Principal axes
// describe the same shape, also for thin and flat ellipsoids. Export loses only float32 precision,
// and gives as few chunks as float32 centers allow, each relative to its chunk. A field that is
// imported and exported again is the same field.
//
// If isHeld() is true, the whole support of an ellipsoid is inside its listed support, over
// random steps of many sizes. Growth by the slack is the largest growth that is held, and a move by
// the slack is the largest move. motionSince() is an upper bound of the slack that is needed. A
// step beyond the slack is refused. Young ellipsoids get the largest slack. optimiser_test.cpp
// tests fits whose ellipsoids move fast.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "field/random_field.h"
#include "fit/ellipsoid.h"
#include "fit/gradient_scene.h"
#include "fit/motion_bound.h"

namespace esvr {
namespace {

Ellipsoid sphere(double scale) {
  return {{1.0, 2.0, 3.0}, {1 / scale, 0, 0, 0, 1 / scale, 0, 0, 0, 1 / scale}, 0.5};
}

/// Sigma^-1 = L^T L, which is the shape without the rotation on the left of L.
Matrix3 precision(const Matrix3& L) {
  Matrix3 p{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) p[3 * i + j] += L[3 * k + i] * L[3 * k + j];
  return p;
}

TEST(ApplyStep, MovesTheCenterInUnitsOfTheScale) {
  Ellipsoid p = sphere(2.0);
  applyStep(p, {0.1, 0.0, 0.0});
  EXPECT_DOUBLE_EQ(p.center[0], 1.2);
  EXPECT_EQ(p.center[1], 2.0);
}

TEST(ApplyStep, GrowsASemiAxisByTheRelativeStep) {
  Ellipsoid p = sphere(2.0);
  applyStep(p, {0, 0, 0, 0.01});
  // The step is exp(0.01) to second order; the third-order term is 2e-7.
  EXPECT_NEAR(principalAxes(p.L).scale[0], 2.0 * std::exp(0.01), 1e-6);
  EXPECT_NEAR(principalAxes(p.L).scale[2], 2.0, 1e-12);
}

TEST(ClampScales, HoldsBothLimitsAndKeepsTheDirections) {
  Ellipsoid p = sphere(1.0);
  p.L = {100.0, 0, 0, 0, 1.0, 0, 0, 0, 0.01};
  clampScales(p, 0.25, 64.0);
  const PrincipalAxes axes = principalAxes(p.L);
  // At an aspect ratio of 1e4, ten times what fits meet, the closed-form solver is precise to 1e-4.
  EXPECT_NEAR(axes.scale[0], 64.0, 64.0 * 1e-4);
  EXPECT_NEAR(axes.scale[1], 1.0, 1e-4);
  EXPECT_NEAR(axes.scale[2], 0.25, 1e-12);
}

TEST(ClampScales, LeavesWhatIsWithinUntouched) {
  Ellipsoid p = sphere(3.0);
  const Matrix3 before = p.L;
  clampScales(p, 0.25, 64.0);
  EXPECT_EQ(p.L, before);
}

class Aspect : public testing::TestWithParam<double> {};

// The rounding of the quaternion to float32 turns the long axis by 1e-7. In units of the short axis
// this is larger by the aspect ratio, and it is squared in Sigma^-1.
TEST_P(Aspect, ExportKeepsTheShape) {
  const Field field =
      test::randomField({.count = 50, .smallest = 0.3, .aspect = GetParam(), .seed = 4});
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const Ellipsoid p{{10.0, 20.0, 30.0}, unitFrame(e, i), 0.25};
    const Field out = exportField({&p, 1}, {{8, 16, 24}, 0.5, 1.0f, {}});
    EXPECT_TRUE(wellFormed(out.chunks[0].ellipsoids));
    EXPECT_EQ(out.chunks[0].origin, (Coord{8, 16, 24}));
    EXPECT_FLOAT_EQ(out.chunks[0].ellipsoids.intensity[0], 0.5f);
    const Matrix3 a = precision(p.L), b = precision(unitFrame(out.chunks[0].ellipsoids, 0));
    double error = 0.0, norm = 0.0;
    for (std::size_t k = 0; k < 9; ++k) error += std::pow(a[k] - b[k], 2), norm += a[k] * a[k];
    EXPECT_LT(std::sqrt(error / norm), 2e-6) << i;
  }
}
INSTANTIATE_TEST_SUITE_P(Shapes, Aspect, testing::Values(1.0, 10.0, 1000.0));

using Center = std::array<double, 3>;

/// A ball with a scale of 1 and an intensity of 2 at each center.
Field exported(const std::vector<Center>& centers, const ExportFrame& frame = {}) {
  std::vector<Ellipsoid> ellipsoids(centers.size());
  for (std::size_t i = 0; i < centers.size(); ++i) {
    ellipsoids[i].center = centers[i];
    ellipsoids[i].L = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    ellipsoids[i].intensity = 2.0;
  }
  return exportField(ellipsoids, frame);
}

ExportFrame frameAt(Coord origin) {
  ExportFrame frame;
  frame.origin = origin;
  return frame;
}

constexpr double kChunkSide = kChunkExtent;

TEST(ExportField, KeepsCentersALittleBeforeTheOriginInOneChunk) {
  const Field field =
      exported({{-0.25, 3.0, 0.0}, {10.0, -7.5, kChunkSide - 1.0}}, frameAt({8, 16, 24}));
  ASSERT_EQ(field.chunks.size(), 1u);
  EXPECT_EQ(field.chunks[0].origin, (Coord{8, 16, 24}));
  const Ellipsoids& e = field.chunks[0].ellipsoids;
  EXPECT_EQ(e.center[0], (std::vector<float>{-0.25f, 10.0f}));
  EXPECT_EQ(e.center[1], (std::vector<float>{3.0f, -7.5f}));
}

TEST(ExportField, DividesCentersThatAreTooFarForOneChunk) {
  const Field field = exported({{-0.25, 0.0, 0.0}, {5.0, 0.0, 0.0}, {kChunkSide + 1.5, 0.0, 0.0}},
                               frameAt({8, 0, 0}));
  ASSERT_EQ(field.chunks.size(), 3u);
  const std::array<float, 3> centers{float(kChunkSide) - 0.25f, 5.0f, 1.5f};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(field.chunks[c].origin, (Coord{8 + (int(c) - 1) * kChunkExtent, 0, 0}));
    EXPECT_EQ(field.chunks[c].ellipsoids.center[0], std::vector<float>{centers[c]});
  }
}

TEST(ExportField, MayHaveNoEllipsoids) { EXPECT_TRUE(exported({}).chunks.empty()); }

TEST(ExportField, GivesIntensitiesInUnitsOfTheGrid) {
  ExportFrame frame;
  frame.scale = 0.5;
  frame.background = 0.25f;
  const Field field = exported({{1.0, 1.0, 1.0}}, frame);
  EXPECT_EQ(field.background, 0.25f);
  EXPECT_EQ(field.chunks[0].ellipsoids.intensity, std::vector<float>{4.0f});
}

TEST(ImportField, IsTheWayBack) {
  const Field field = test::randomField(
      {.count = 200, .extent = 200.0, .smallest = 0.5, .aspect = 50.0, .origin = {64, 0, 128}});
  const Coord origin{64, 0, 128};
  const Field back = exportField(importField(field, origin, 0.5),
                                 {.origin = origin, .scale = 0.5, .kernel = field.kernel});
  ASSERT_EQ(back.chunks.size(), 1u);
  const Ellipsoids &a = field.chunks[0].ellipsoids, &b = back.chunks[0].ellipsoids;
  EXPECT_EQ(a.center, b.center);
  EXPECT_EQ(a.intensity, b.intensity);
  for (std::size_t i = 0; i < a.size(); ++i) {
    // The axes may come back in another order, but the matrix is the same to float32 precision.
    const Matrix3 A = inverse(unitFrame(a, i)), B = inverse(unitFrame(b, i));
    const double size = sigma(A, 0, 0) + sigma(A, 1, 1) + sigma(A, 2, 2);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(sigma(A, r, c), sigma(B, r, c), 1e-5 * size) << i;
  }
}

// ---- How far a support moves

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
