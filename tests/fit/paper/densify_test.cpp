// Plan: the tests check which ellipsoids are cloned, split or left, the parameters of clones and
// parts, the state that is reset, the limit on their number, and that every run makes the same
// choices.

#include "fit/paper/densify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace esvr::paper {
namespace {

constexpr double kSplitAbove = 2.0;

PaperEllipsoid sphere(double x, double scale) {
  PaperEllipsoid p{{x, 0.0, 0.0}, {}, {1.0, 0.0, 0.0, 0.0}, 0.8, 5.0};
  p.logScale.fill(std::log(scale));
  return p;
}

PaperState stateOf(double meanGradient) {
  PaperState state;
  state.gradientSum = 4.0 * meanGradient;
  state.seen = 4;
  state.m[0] = 1.0f;
  return state;
}

/// Small and large ellipsoids, with small and large gradients.
Population fourOf() {
  return {{sphere(0, 1.0), sphere(10, 1.0), sphere(20, 3.0), sphere(30, 3.0)},
          {stateOf(0.5), stateOf(2.0), stateOf(0.5), stateOf(2.0)}};
}

DensifyRule ruleOf(std::size_t maxCount = 100) {
  return {.threshold = 1.0, .splitAbove = kSplitAbove, .maxCount = maxCount, .seed = 7};
}

TEST(Densify, ClonesTheSmallAndSplitsTheLargeOfThoseWithLargeGradients) {
  Population population = fourOf();
  const auto counts = densify(population, ruleOf());
  EXPECT_EQ(counts.cloned, 1u);
  EXPECT_EQ(counts.split, 1u);
  ASSERT_EQ(population.size(), 6u);
  ASSERT_EQ(population.states.size(), 6u);
  EXPECT_EQ(population.ellipsoids[0].center[0], 0.0);
  EXPECT_EQ(population.ellipsoids[1].center[0], 10.0);
  EXPECT_EQ(population.ellipsoids[2].center[0], 20.0);  // the large one that was split is gone
  EXPECT_EQ(population.ellipsoids[3].center[0], 10.0);  // the clone
}

TEST(Densify, AThresholdCountsWhereItIsMetExactly) {
  Population population = fourOf();
  auto rule = ruleOf();
  rule.threshold = 0.5;
  EXPECT_EQ(densify(population, rule).cloned, 2u);
}

TEST(Densify, WhatWasNeverSeenIsLeftEvenAtAThresholdOfZero) {
  Population population = fourOf();
  population.states[1] = {};
  auto rule = ruleOf();
  rule.threshold = 0.0;
  EXPECT_EQ(densify(population, rule).cloned, 1u);
}

TEST(Densify, ACloneAndItsOriginalAddUpToWhatWas) {
  Population population = fourOf();
  densify(population, ruleOf());
  EXPECT_EQ(population.ellipsoids[1].intensity + population.ellipsoids[3].intensity, 0.8);
  EXPECT_EQ(population.ellipsoids[1].logScale, population.ellipsoids[3].logScale);
}

TEST(Densify, PartsOfASplitAreSmallerAndLieWithinAFewScales) {
  Population population = fourOf();
  densify(population, ruleOf());
  for (const std::size_t i : {4u, 5u}) {
    const PaperEllipsoid& part = population.ellipsoids[i];
    EXPECT_NEAR(std::exp(part.logScale[0]), 3.0 / 1.6, 1e-12);
    EXPECT_EQ(part.intensity, 0.8);
    EXPECT_NE(part.center[0], 30.0);
    EXPECT_LT(std::hypot(part.center[0] - 30.0, part.center[1], part.center[2]), 6.0 * 3.0);
  }
  EXPECT_NE(population.ellipsoids[4].center, population.ellipsoids[5].center);
}

// Over n draws, the errors of the mean and of the deviation of a normal distribution are s /
// sqrt(n) and s / sqrt(2 n).
TEST(Densify, PartsAreDrawnWithTheScalesOfTheWhole) {
  constexpr std::size_t kCount = 4000;
  Population population;
  PaperEllipsoid needle = sphere(0.0, 3.0);
  needle.logScale = {std::log(8.0), std::log(3.0), std::log(1.0)};
  const double half = std::sqrt(0.5);
  needle.rotation = {half, 0.0, 0.0, half};  // 90 degrees about z: the long axis along y
  population.ellipsoids.assign(kCount, needle);
  population.states.assign(kCount, stateOf(2.0));
  densify(population, {.threshold = 1.0, .splitAbove = 2.0, .maxCount = 3 * kCount, .seed = 3});
  ASSERT_EQ(population.size(), 2 * kCount);
  const double expected[3] = {3.0, 8.0, 1.0};
  for (std::size_t a = 0; a < 3; ++a) {
    double sum = 0.0, squares = 0.0;
    for (const auto& p : population.ellipsoids) {
      sum += p.center[a];
      squares += p.center[a] * p.center[a];
    }
    const double n = double(population.size());
    EXPECT_NEAR(sum / n, 0.0, 4.0 * expected[a] / std::sqrt(n));
    EXPECT_NEAR(std::sqrt(squares / n), expected[a], 4.0 * expected[a] / std::sqrt(2.0 * n));
  }
}

TEST(Densify, NewOnesBeginWithoutMomentumAndAllWithoutGradients) {
  Population population = fourOf();
  densify(population, ruleOf());
  for (std::size_t i = 0; i < population.size(); ++i) {
    EXPECT_EQ(population.states[i].seen, 0u);
    EXPECT_EQ(population.states[i].gradientSum, 0.0);
    EXPECT_EQ(population.states[i].m[0], i < 3 ? 1.0f : 0.0f);
  }
}

TEST(Densify, WhereThereIsRoomForFewTheLargestGradientsGoFirst) {
  Population population = fourOf();
  population.states[3] = stateOf(5.0);
  const auto counts = densify(population, ruleOf(5));
  EXPECT_EQ(counts.cloned, 0u);
  EXPECT_EQ(counts.split, 1u);
  EXPECT_EQ(population.size(), 5u);
  EXPECT_EQ(densify(population, ruleOf(5)).cloned, 0u);
}

TEST(Densify, ChoosesTheSameInEveryRun) {
  Population a = fourOf(), b = fourOf();
  densify(a, ruleOf());
  densify(b, ruleOf());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_EQ(a.ellipsoids[i].center, b.ellipsoids[i].center);
}

}  // namespace
}  // namespace esvr::paper
