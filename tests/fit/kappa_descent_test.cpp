// Plan: steps go against the slope, whatever its size, and are at most the largest step. Kappa
// stays within its limits and does not change without a slope. The minimum of a convex function is
// found.

#include "fit/kappa_descent.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esvr {
namespace {

TEST(KappaDescent, StepsAgainstTheSlopeWhateverItsSize) {
  for (const double size : {1e-12, 1.0, 1e12}) {
    EXPECT_FLOAT_EQ(KappaDescent(0.1).next(2.0f, size, 1.0), 1.9f);
    EXPECT_FLOAT_EQ(KappaDescent(0.1).next(2.0f, -size, 0.5), 2.05f);
  }
}

TEST(KappaDescent, StaysWithoutASlope) { EXPECT_EQ(KappaDescent(0.1).next(2.0f, 0.0, 1.0), 2.0f); }

TEST(KappaDescent, KeepsToItsBounds) {
  KappaDescent down(10.0), up(10.0);
  float low = 0.0f, high = 0.0f;
  for (int i = 0; i < 10; ++i) {
    low = down.next(low, 1.0, 1.0);
    high = up.next(high, -1.0, 1.0);
  }
  EXPECT_EQ(low, float(KappaDescent::kSmoothest));
  EXPECT_EQ(high, float(KappaDescent::kHardest));
}

TEST(KappaDescent, FindsAValley) {
  KappaDescent descent(0.1);
  float kappa = -2.0f;
  const int steps = 200;
  for (int i = 0; i < steps; ++i)
    kappa = descent.next(kappa, 1e-5 * (double(kappa) - 3.0), 1.0 - double(i) / steps);
  EXPECT_NEAR(kappa, 3.0f, 0.02f);  // the last steps are shorter than 0.01
}

}  // namespace
}  // namespace esvr
