// Plan: Adam's step under gradients of any size and at its limits; schedules that start and end
// where they say.

#include <gtest/gtest.h>

#include <cmath>

#include "fit/adam.h"
#include "fit/schedule.h"
#include "volumes.h"

namespace esvr {
namespace {

TEST(Adam, FirstStepHasTheTunedSizeWhateverTheGradient) {
  for (const double size : {1e-25, 1.0, 1e25}) {
    std::vector<Primitive> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 1.0}};
    std::vector<AdamState> state(1);
    std::vector<PrimitiveGradient> g(1);
    g[0].byParameter.fill(0.0);
    g[0].byParameter[0] = size;
    adamStep(p, state, g, {0.1, 0.1, 0.1}, {}, {0.25, 64.0, -2.0, 2.0});
    // float32 moments round g^2; below 1e-19 they would underflow, which the target's scale
    // excludes
    if (size > 1e-19 && size < 1e19) {
      EXPECT_NEAR(p[0].center[0], -0.1, 1e-6);
    }
    EXPECT_TRUE(std::isfinite(p[0].center[0]));
  }
}

TEST(Adam, KeepsIntensitiesInRange) {
  std::vector<Primitive> p{{{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, 0.001}};
  std::vector<AdamState> state(1);
  std::vector<PrimitiveGradient> g(1);
  g[0].byParameter.fill(0.0);
  g[0].byParameter[9] = 1.0;
  for (int i = 0; i < 50; ++i) adamStep(p, state, g, {}, {}, {0.25, 64.0, 0.0, 1.5});
  EXPECT_EQ(p[0].intensity, 0.0);
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
