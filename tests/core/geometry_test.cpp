// Plan: coordinates and boxes have the results of their definitions, also at the ends of the index space.
// The numbers of corners are compared with their definition, 4 x + 2 y + z.

#include "core/geometry.h"

#include <gtest/gtest.h>

#include "esvr/volume.h"

namespace esvr {
namespace {

constexpr Coord kFarLow{Box::kMin, Box::kMin, Box::kMin};
constexpr Coord kFarHigh{Box::kMax, Box::kMax, Box::kMax};

TEST(Coord, OrdersByXThenYThenZ) {
  EXPECT_LT((Coord{-1, 9, 9}), (Coord{0, -9, -9}));
  EXPECT_LT((Coord{0, -1, 9}), (Coord{0, 0, -9}));
  EXPECT_LT((Coord{0, 0, -1}), (Coord{0, 0, 0}));
}

TEST(Coord, MinimumAndMaximumAreByComponent) {
  EXPECT_EQ(minCoord({1, -5, 3}, {-1, 5, 3}), (Coord{-1, -5, 3}));
  EXPECT_EQ(maxCoord({1, -5, 3}, {-1, 5, 3}), (Coord{1, 5, 3}));
}

TEST(Coord, PrintsAsUsersWriteIt) { EXPECT_EQ(toString({-1, 0, 27}), "(-1, 0, 27)"); }

TEST(Box, IsEmptyByDefaultAndHoldsNothing) {
  const Box box;
  EXPECT_TRUE(box.empty());
  EXPECT_EQ(box.volume(), 0.0);
  for (const Coord c : std::array{Coord{}, kFarLow, kFarHigh}) EXPECT_FALSE(box.contains(c));
}

TEST(Box, HoldsBothItsCorners) {
  Box box;
  box.expand(Coord{-3, 4, 5});
  EXPECT_EQ(box.volume(), 1.0);
  box.expand(Coord{1, 4, 7});
  EXPECT_EQ(box.min, (Coord{-3, 4, 5}));
  EXPECT_EQ(box.max, (Coord{1, 4, 7}));
  EXPECT_TRUE(box.contains(box.min));
  EXPECT_TRUE(box.contains(box.max));
  EXPECT_FALSE(box.contains({2, 4, 7}));
  EXPECT_FALSE(box.contains({1, 3, 7}));
  EXPECT_FALSE(box.contains({1, 4, 4}));
  EXPECT_EQ(box.volume(), 5.0 * 1.0 * 3.0);
}

TEST(Box, ExpandingByAnEmptyBoxChangesNothing) {
  Box box{{1, 2, 3}, {4, 5, 6}};
  const Box before = box;
  box.expand(Box{});
  EXPECT_EQ(box, before);
}

TEST(Box, CountsTheVoxelsOfTheWholeIndexSpace) {
  // The volume is 2^32 cubed. Integers would overflow with the first side.
  const Box box{kFarLow, kFarHigh};
  EXPECT_EQ(box.volume(), 0x1p96);
}

TEST(CellCorner, isNumberedWithZFastest) {
  int number = 0;
  for (int x = 0; x < 2; ++x)
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z, ++number) {
        EXPECT_EQ(stepToCorner(number), (Coord{x, y, z}));
        EXPECT_EQ(cornerAt({x, y, z}), number);
      }
  EXPECT_EQ(number, kCellCorners);
}

}  // namespace
}  // namespace esvr
