// Plan: the numbers add up to the wanted one and keep to their limits, equal chunks get equal
// numbers, and where the numbers are the best ones, moving an ellipsoid does not lower the error.

#include "fit/chunks/divide_count.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace esvr {
namespace {

std::size_t sumOf(const std::vector<std::size_t>& numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), std::size_t{0});
}

TEST(DivideCount, GivesEqualChunksEqualNumbers) {
  const std::vector<ChunkNeed> needs(4, {2.0, 10.0, 0, 1000});
  EXPECT_EQ(dividedCount(100, needs), (std::vector<std::size_t>{25, 25, 25, 25}));
  EXPECT_EQ(sumOf(dividedCount(101, needs)), 101u);
}

TEST(DivideCount, LowersTheErrorThatFallsWith45DbPerDoubling) {
  const std::vector<ChunkNeed> needs{{1.0, 100.0, 0, 100000}, {50.0, 100.0, 0, 100000}};
  const auto numbers = dividedCount(10000, needs);
  const auto errorOf = [&](double first, double second) {
    const double power = 0.45 / std::log10(2.0);
    return needs[0].error * std::pow(first / 100.0, -power) +
           needs[1].error * std::pow(second / 100.0, -power);
  };
  const double a = double(numbers[0]), b = double(numbers[1]);
  EXPECT_LT(errorOf(a, b), errorOf(a + 100.0, b - 100.0));
  EXPECT_LT(errorOf(a, b), errorOf(a - 100.0, b + 100.0));
}

TEST(DivideCount, KeepsToTheLimits) {
  const std::vector<ChunkNeed> needs{
      {1.0, 10.0, 70, 1000}, {1.0, 10.0, 0, 5}, {1.0, 10.0, 0, 1000}};
  const auto numbers = dividedCount(100, needs);
  EXPECT_EQ(numbers, (std::vector<std::size_t>{70, 5, 25}));
}

TEST(DivideCount, GivesNothingToChunksWithoutError) {
  const std::vector<ChunkNeed> needs{{0.0, 10.0, 0, 1000}, {1.0, 10.0, 0, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{0, 50}));
}

TEST(DivideCount, KeepsMoreThanTheCountWhereChunksHaveThem) {
  const std::vector<ChunkNeed> needs{{1.0, 30.0, 30, 1000}, {1.0, 30.0, 30, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{30, 30}));
}

}  // namespace
}  // namespace esvr
