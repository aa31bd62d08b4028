// Plan: the tests check ticks at round numbers on linear and logarithmic axes, values that cannot
// be shown, and axes of one value and of none.

#include "report/axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace esvr::report {
namespace {

std::vector<std::string> labels(const Axis& axis) {
  std::vector<std::string> texts;
  for (const auto& tick : axis.ticks()) texts.push_back(tick.label);
  return texts;
}
using Labels = std::vector<std::string>;

TEST(Axis, hasTicksAtRoundNumbers) {
  const std::vector<double> values{31.2, 44.9};
  EXPECT_EQ(labels(Axis(values, false)), (Labels{"32", "34", "36", "38", "40", "42", "44"}));
}

TEST(Axis, hasTicksAtPowersWhereItIsLogarithmic) {
  const std::vector<double> values{8e3, 1.2e6};
  EXPECT_EQ(labels(Axis(values, true)),
            (Labels{"10000", "20000", "50000", "100000", "200000", "500000", "1e+06"}));
  const std::vector<double> narrow{3.2, 6.8};
  EXPECT_EQ(labels(Axis(narrow, true)), (Labels{"4", "5", "6", "7"}));
  const std::vector<double> wide{1e-4, 1e4};
  EXPECT_EQ(labels(Axis(wide, true)).size(), 9u);
  const std::vector<double> widest{1e-20, 1e20};
  EXPECT_EQ(labels(Axis(widest, true)),
            (Labels{"1e-20", "1e-15", "1e-10", "1e-05", "1", "100000", "1e+10", "1e+15", "1e+20"}))
      << "every fifth power";
}

TEST(Axis, hasThreeTicksOrMoreWhateverItsRange) {
  for (const bool logarithmic : {false, true})
    for (const int most : {Axis::kFewestAllowed, Axis::kUsualTicks})
      for (const double low : {1e-6, 0.7, 3.0, 9.9, 1234.5})
        for (double factor = 1.001; factor < 1e12; factor *= 1.3) {
          const std::vector<double> values{low, factor * low};
          const auto ticks = Axis(values, logarithmic).ticks(most);
          EXPECT_GE(ticks.size(), 3u) << logarithmic << ", " << low << ", " << factor;
          EXPECT_LE(ticks.size(), std::size_t(most))
              << logarithmic << ", " << low << ", " << factor;
        }
}

Labels roundLabels(double low, double high, double most) {
  Labels texts;
  for (const Tick& tick : roundTicks(low, high, most)) texts.push_back(tick.label);
  return texts;
}

TEST(RoundTicks, includeTheEndsThatAreRound) {
  EXPECT_EQ(roundLabels(0.0, 1.0, 5.0), (Labels{"0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(roundLabels(-3.0, 3.0, 7.0), (Labels{"-3", "-2", "-1", "0", "1", "2", "3"}));
  EXPECT_EQ(roundLabels(double(0.1f), double(0.3f), 4.0),
            (Labels{"0.10", "0.15", "0.20", "0.25", "0.30"}));
}

TEST(RoundTicks, canBeDistinguishedInNarrowRanges) {
  EXPECT_EQ(roundLabels(1000.0001, 1000.0009, 4.0),
            (Labels{"1.0000002e+03", "1.0000004e+03", "1.0000006e+03", "1.0000008e+03"}));
  EXPECT_EQ(roundLabels(0.0, 5e-6, 5.0),
            (Labels{"0", "1e-06", "2e-06", "3e-06", "4e-06", "5e-06"}));
  EXPECT_EQ(roundLabels(0.0, 3e7, 3.0), (Labels{"0", "1e+07", "2e+07", "3e+07"}));
}

TEST(RoundTicks, areThereForAnyRange) {
  EXPECT_EQ(roundLabels(0.25, 0.25, 5.0), (Labels{"0.25"}));
  EXPECT_EQ(roundTicks(1.0, std::nextafter(1.0, 2.0), 5.0).size(), 1u)
      << "no room for round numbers";
  EXPECT_EQ(roundTicks(-1.7e308, 1.7e308, 5.0).size(), 1u) << "the range is not finite";
}

TEST(Axis, placesValuesBetweenItsEnds) {
  const std::vector<double> values{0.0, 10.0};
  const Axis axis(values, false);
  EXPECT_NEAR(axis.place(5.0), 0.5, 1e-15);
  EXPECT_GT(axis.place(0.0), 0.0) << "some room";
  EXPECT_LT(axis.place(10.0), 1.0);
}

TEST(Axis, holdsOnlyWhatItCanShow) {
  const std::vector<double> values{-1.0, 1.0, 100.0, std::numeric_limits<double>::infinity()};
  const Axis axis(values, true);
  EXPECT_FALSE(axis.holds(-1.0));
  EXPECT_FALSE(axis.holds(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(axis.holds(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_TRUE(axis.holds(100.0));
}

TEST(Axis, isThereForOneValueAndForNone) {
  const std::vector<double> one{7.0};
  EXPECT_NEAR(Axis(one, false).place(7.0), 0.5, 1e-15);
  EXPECT_GE(Axis(one, false).ticks().size(), 3u);
  EXPECT_GE(Axis(one, true).ticks().size(), 3u);
  EXPECT_FALSE(Axis({}, false).ticks().empty());
}

}  // namespace
}  // namespace esvr::report
