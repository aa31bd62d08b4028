// Plan: the random numbers are compared with stored constants, which reveals any change. The tests
// also check ranges, and the continuity and the slope of noise.

#include "generators/hash_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace esvr::samples {
namespace {

TEST(Random, streamsAreFixedForever) {
  Random random(1);
  EXPECT_EQ(random.uniform(), 0x1.b9c847f90581ap-1);
  EXPECT_EQ(random.uniform(), 0x1.bb83da0a505a3p-1);
  EXPECT_NE(Random(2).uniform(), Random(1).uniform());
}

TEST(Random, uniformFillsItsRangeEvenly) {
  Random random(7);
  constexpr int kDraws = 100'000;
  double sum = 0.0, low = 1.0, high = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    sum += u;
    low = std::min(low, u);
    high = std::max(high, u);
  }
  EXPECT_GE(low, 0.0);
  EXPECT_LT(high, 1.0);
  // The standard deviation of the mean is sqrt(1 / 12 / draws) = 9e-4; the tolerance is five of
  // them.
  EXPECT_NEAR(sum / kDraws, 0.5, 4.6e-3);
}

TEST(Random, directionsAreUnitVectors) {
  Random random(3);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(length(random.direction()), 1.0, 1e-15);
}

TEST(Noise, isFixedForever) {
  EXPECT_EQ(noise(1, {0.25, -3.5, 100.125}), -0x1.6c0daa827d045p-1);
  EXPECT_EQ(fractalNoise(1, {0.25, -3.5, 100.125}, 4), -0x1.2786d168665dep-2);
}

TEST(Noise, staysInRangeAndUsesIt) {
  double low = 0.0, high = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const double v = noise(5, {0.37 * i, 0.11 * i, -0.23 * i});
    low = std::min(low, v);
    high = std::max(high, v);
  }
  EXPECT_GE(low, -1.0);
  EXPECT_LE(high, 1.0);
  EXPECT_LT(low, -0.7);
  EXPECT_GT(high, 0.7);
}

TEST(Noise, isContinuousAcrossLatticePlanesAndNoSteeperThanItsBound) {
  constexpr double kStep = 1.0 / 64.0;
  for (int i = -640; i < 640; ++i) {
    const Vec3 p{0.3, i * kStep, -1.7};
    const double rise = std::abs(noise(9, p + Vec3{0.0, kStep, 0.0}) - noise(9, p));
    EXPECT_LE(rise, kNoiseSlope * kStep);
  }
}

}  // namespace
}  // namespace esvr::samples
