// Plan: the search finds the x at which a figure reaches its target: on a straight line, on a
// curve, on a line with steps, and at both ends of the range.

#include "encode/root_search.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esvr::encode {
namespace {

constexpr double kNarrowest = 0.002;

/// The x at which `figure` reaches the aim, after at most `trials`.
template <class Figure>
double found(double aim, double first, int trials, const Figure& figure, bool learnsSlope = false) {
  RootSearch search({.low = 1.0, .high = 24.0, .narrowest = kNarrowest, .learnsSlope = learnsSlope},
                    aim, 6.0, first);
  double best = std::nan("");
  for (int n = 0; n < trials && !search.ended(); ++n) {
    const double x = search.next(), now = figure(x);
    if (now >= aim && !(best <= x)) best = x;
    search.learn(now);
  }
  return best;
}

TEST(RootSearch, FindsAPointOfALine) {
  const auto line = [](double x) { return 6.0 * x + 3.0; };
  for (const double first : {1.0, 5.0, 9.9, 24.0})
    EXPECT_NEAR(found(63.0, first, 6, line), 10.0, 0.05);
}

TEST(RootSearch, FindsAPointOfACurve) {
  const auto curve = [](double x) { return 40.0 * std::log2(x); };
  EXPECT_NEAR(found(100.0, 2.0, 12, curve), std::exp2(2.5), 0.02);
}

TEST(RootSearch, FindsTheRiseOfAStep) {
  const auto step = [](double x) { return x < 7.3 ? 20.0 : 80.0; };
  EXPECT_NEAR(found(50.0, 3.0, 40, step), 7.3, 2.0 * kNarrowest);
}

TEST(RootSearch, FindsTheRiseOfAStepThatEndsNearTheAim) {
  const auto step = [](double x) { return x < 7.3 ? 20.0 : 52.0; };
  EXPECT_NEAR(found(50.0, 3.0, 12, step), 7.3, 0.05);
}

TEST(RootSearch, TakesAnInfiniteFigure) {
  const auto exact = [](double x) {
    return x > 4.0 ? std::numeric_limits<double>::infinity() : 6.0 * x;
  };
  EXPECT_NEAR(found(50.0, 12.0, 40, exact), 4.0, 2.0 * kNarrowest);
}

TEST(RootSearch, FollowsTheSlopeThatTwoTrialsShow) {
  const auto flat = [](double x) { return 2.0 * x; };  // a third of the usual slope
  EXPECT_NEAR(found(30.0, 1.0, 5, flat, true), 15.0, 0.5);
}

TEST(RootSearch, TakesNoStepThatIsTooLong) {
  RootSearch search({.low = 0.0, .high = 100.0, .narrowest = kNarrowest, .longest = 10.0}, 90.0,
                    1.0, 0.0);
  for (const double x : {0.0, 10.0, 20.0}) {
    EXPECT_NEAR(search.next(), x, 1e-9);
    search.learn(0.1 * x);
  }
}

TEST(RootSearch, EndsWhereNothingReachesTheAim) {
  EXPECT_TRUE(std::isnan(found(50.0, 12.0, 200, [](double) { return 0.0; })));
}

}  // namespace
}  // namespace esvr::encode
