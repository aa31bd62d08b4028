// Plan: Adam's step is checked for gradients of any size, for a scaled loss, at its limits, and
// over many steps. Schedules start and end at the given values.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "fit/adam.h"
#include "fit/tuning.h"
#include "volumes.h"

namespace esvr {
namespace {

TEST(Adam, FirstStepHasTheTunedSizeWhateverTheGradient) {
  for (const double size : {1e-25, 1.0, 1e25}) {
    std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1.0}};
    std::vector<AdamState> state(1);
    std::vector<EllipsoidGradient> g(1);
    g[0].byParameter.fill(0.0);
    g[0].byParameter[0] = size;
    adamStep(p, state, g, {{0.1, 0.1, 0.1}, {}, {0.25, 64.0, -2.0, 2.0}});
    // Float32 moments round g^2. Below 1e-19 they would underflow, which the target's scale
    // excludes.
    if (size > 1e-19 && size < 1e19) {
      EXPECT_NEAR(p[0].center[0], -0.1, 1e-6);
    }
    EXPECT_TRUE(std::isfinite(p[0].center[0]));
  }
}

TEST(Adam, KeepsIntensitiesInRange) {
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0.001}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  g[0].byParameter.fill(0.0);
  g[0].byParameter[9] = 1.0;
  for (int i = 0; i < 50; ++i) adamStep(p, state, g, {{}, {}, {0.25, 64.0, 0.0, 1.5}});
  EXPECT_EQ(p[0].intensity, 0.0);
}

/// A hundred steps down the bowl |center - (1, 2, 3)|^2 / 2, with a scaled gradient.
std::array<double, 3> descend(double scale) {
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  for (int i = 0; i < 100; ++i) {
    g[0].byParameter.fill(0.0);
    for (std::size_t a = 0; a < 3; ++a)
      g[0].byParameter[a] = scale * (p[0].center[a] - double(a + 1));
    adamStep(p, state, g, {{}, {}, {0.25, 64.0, 0.0, 1.5}});
  }
  return p[0].center;
}

TEST(Adam, TakesTheSameWayHoweverTheLossIsScaled) {
  const auto expected = descend(1.0);
  for (const double scale : {1e-6, 1e6}) {
    const auto found = descend(scale);
    // Float32 moments round the scaled gradients differently, by 1e-7 for each step.
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(found[a], expected[a], 1e-4);
  }
}

TEST(Adam, LeavesALimitWhenTheGradientPointsBackInside) {
  constexpr double kSmallest = 0.25;
  std::vector<Ellipsoid> p{{{0, 0, 0}, {4, 0, 0, 0, 4, 0, 0, 0, 4}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  g[0].byParameter.fill(0.0);
  const auto push = [&](double gradient, int steps) {
    for (int k = 3; k < 6; ++k) g[0].byParameter[std::size_t(k)] = gradient;
    for (int i = 0; i < steps; ++i) adamStep(p, state, g, {{}, {}, {kSmallest, 64.0, 0.0, 1.5}});
    return principalAxes(p[0].L).scale[2];
  };
  EXPECT_NEAR(push(1.0, 30), kSmallest, 1e-9);  // shrinks until the limit holds it
  EXPECT_GT(push(-1.0, 60), 2 * kSmallest);
}

TEST(Adam, SlowKeepsAShapeValidOverAHundredThousandSteps) {
  test::Random random(11);
  std::vector<Ellipsoid> p{{{0, 0, 0}, {1, 0, 0, 0, 0.5, 0, 0, 0, 2}, 1.0}};
  std::vector<AdamState> state(1);
  std::vector<EllipsoidGradient> g(1);
  for (int i = 0; i < 100'000; ++i) {
    for (double& value : g[0].byParameter) value = random(-1.0, 1.0);
    adamStep(p, state, g, {{}, {}, {0.25, 16.0, 0.0, 1.5}});
  }
  const PrincipalAxes axes = principalAxes(p[0].L);
  double norm2 = 0.0;
  for (const double q : axes.rotation) norm2 += q * q;
  EXPECT_NEAR(norm2, 1.0, 1e-12);
  EXPECT_GE(axes.scale[2], 0.25 * (1 - 1e-6));  // the precision of the closed-form eigensolver
  EXPECT_LE(axes.scale[0], 16.0 * (1 + 1e-6));
}

TEST(Schedule, GoesFromItsFirstCountToItsLast) {
  const Tuning tuning;
  const Schedule schedule{100, 1000, 500, tuning};
  EXPECT_EQ(schedule.countAt(0.0), 100u);
  EXPECT_EQ(schedule.countAt(tuning.growUntil), 1000u);
  EXPECT_EQ(schedule.countAt(1.0), 1000u);
  EXPECT_GT(schedule.stepAt(0.5, 250), tuning.finalStep);
  EXPECT_EQ(schedule.stepAt(1.0, 499), 0.0);
  EXPECT_EQ(schedule.relocationsAt(1.0, 1000), 0u);
}

}  // namespace
}  // namespace esvr
