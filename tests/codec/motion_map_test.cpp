// Plan: on places in a regular order, the cubes and so the sums are known. The order of motions does
// not matter, and places below 0 are like others.

#include "codec/motion_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace esvr::codec {
namespace {

constexpr std::int64_t kCell = std::int64_t{1} << 23;  // units of places, as in the coder
constexpr int kSide = 8;                               // cells

/// A place in the middle of every cell of a cube of cells.
std::vector<Vector64> placesFrom(std::int64_t lowest) {
  std::vector<Vector64> places;
  for (std::int64_t x = 0; x < kSide; ++x)
    for (std::int64_t y = 0; y < kSide; ++y)
      for (std::int64_t z = 0; z < kSide; ++z)
        places.push_back({(lowest + x) * kCell + kCell / 2, (lowest + y) * kCell + kCell / 2,
                          (lowest + z) * kCell + kCell / 2});
  return places;
}

/// The map of places whose motions are their cells. The motion before is the negative one.
MotionMap mapOf(const std::vector<Vector64>& places) {
  MotionMap map(places);
  for (const Vector64& place : places) {
    MotionSum one{1, {}, {}, 1};
    for (std::size_t a = 0; a < 3; ++a) one.now[a] = place[a] >> 23, one.before[a] = -one.now[a];
    map.add(place, one);
  }
  return map;
}

/// The sum over the cells first to last along each axis, of which there are n on a side.
void expectCells(const MotionSum& sum, std::int64_t first, std::int64_t last) {
  const std::int64_t n = last - first + 1, total = (first + last) * n / 2 * n * n;
  EXPECT_EQ(sum.count, n * n * n);
  EXPECT_EQ(sum.error, n * n * n);
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(sum.now[a], total);
    EXPECT_EQ(sum.before[a], -total);
  }
}

// With an ellipsoid in each cell, cubes of 2 cells on a side are the smallest that hold 2 on average.
TEST(MotionMap, SumsTheCubeOfAPlaceAndThoseAround) {
  const auto places = placesFrom(0);
  const MotionMap map = mapOf(places);
  expectCells(map.around({4 * kCell, 4 * kCell, 4 * kCell}), 2, 7);
  expectCells(map.around({0, 0, 0}), 0, 3);
  EXPECT_EQ(map.around({100 * kCell, 0, 0}).count, 0);
}

TEST(MotionMap, TreatsPlacesBelowZeroLikeOthers) {
  const MotionMap map = mapOf(placesFrom(-4));
  expectCells(map.around({-1, -1, -1}), -4, 1);
  expectCells(map.around({0, 0, 0}), -2, 3);
}

TEST(MotionMap, DoesNotDependOnTheOrder) {
  auto places = placesFrom(0);
  const MotionMap map = mapOf(places);
  std::reverse(places.begin(), places.end());
  const MotionMap reversed = mapOf(places);
  for (const Vector64& place : places) {
    EXPECT_EQ(map.around(place).now, reversed.around(place).now);
    EXPECT_EQ(map.around(place).count, reversed.around(place).count);
  }
}

TEST(MotionMap, HasLargerCubesWhereThereAreFewPlaces) {
  const std::vector<Vector64> places{{0, 0, 0}, {1000 * kCell, 0, 0}, {0, 1000 * kCell, 0}};
  MotionMap map(places);
  map.add(places[0], {1, {5, 6, 7}, {}, 0});
  EXPECT_EQ(map.around(places[1]).count, 1);
  EXPECT_EQ(map.around(places[2]).now, (Vector64{5, 6, 7}));
}

TEST(MotionMap, MayBeEmpty) {
  const MotionMap none({});
  EXPECT_EQ(none.around({0, 0, 0}).count, 0);
  const std::vector<Vector64> one{{1, 2, 3}};
  EXPECT_EQ(MotionMap(one).around(one[0]).count, 0);
}

}  // namespace
}  // namespace esvr::codec
