// Plan: the numbers of corners are compared with their definition, 4 x + 2 y + z.

#include "core/cell_corner.h"

#include <gtest/gtest.h>

namespace esvr {
namespace {

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
