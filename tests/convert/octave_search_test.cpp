// Plan: the search finds the octave at which a figure reaches its target: on a straight line, on a
// curve, on a line with steps, and at both ends of the octaves.

#include "convert/octave_search.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esvr::convert {
namespace {

/// The octave at which `figure` reaches the aim, after at most `trials`.
template <class Figure>
double found(double aim, double first, int trials, const Figure& figure) {
  OctaveSearch search(aim, 6.0, first);
  double best = std::nan("");
  for (int n = 0; n < trials && !search.ended(); ++n) {
    const double octave = search.next(), now = figure(octave);
    if (now >= aim && !(best <= octave)) best = octave;
    search.learn(now);
  }
  return best;
}

TEST(OctaveSearch, FindsAPointOfALine) {
  const auto line = [](double octave) { return 6.0 * octave + 3.0; };
  for (const double first : {1.0, 5.0, 9.9, 24.0})
    EXPECT_NEAR(found(63.0, first, 6, line), 10.0, 0.05);
}

TEST(OctaveSearch, FindsAPointOfACurve) {
  const auto curve = [](double octave) { return 40.0 * std::log2(octave); };
  EXPECT_NEAR(found(100.0, 2.0, 12, curve), std::exp2(2.5), 0.02);
}

TEST(OctaveSearch, FindsTheRiseOfAStep) {
  const auto step = [](double octave) { return octave < 7.3 ? 20.0 : 80.0; };
  EXPECT_NEAR(found(50.0, 3.0, 40, step), 7.3, 2.0 * kNarrowest);
}

TEST(OctaveSearch, FindsTheRiseOfAStepThatEndsNearTheAim) {
  const auto step = [](double octave) { return octave < 7.3 ? 20.0 : 52.0; };
  EXPECT_NEAR(found(50.0, 3.0, 12, step), 7.3, 0.05);
}

TEST(OctaveSearch, TakesAnInfiniteFigure) {
  const auto exact = [](double octave) {
    return octave > 4.0 ? std::numeric_limits<double>::infinity() : 6.0 * octave;
  };
  EXPECT_NEAR(found(50.0, 12.0, 40, exact), 4.0, 2.0 * kNarrowest);
}

TEST(OctaveSearch, EndsWhereNothingReachesTheAim) {
  EXPECT_TRUE(std::isnan(found(50.0, 12.0, 200, [](double) { return 0.0; })));
}

}  // namespace
}  // namespace esvr::convert
