// Plan: counts, ranges and the comparison follow from the values and their voxels alone, whatever the
// order and the tiles. Any change of a value, a voxel or an axis makes values different.

#include "esvr/grid.h"

#include <gtest/gtest.h>

#include <limits>

namespace esvr {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

InactiveValues one(double value, Coord voxel) {
  InactiveValues values;
  values.add(value, voxel);
  return values;
}

TEST(InactiveValues, OfATileAreThoseOfItsVoxels) {
  const Box tile{{-4, 8, 100}, {3, 15, 107}};
  InactiveValues whole, voxels;
  whole.add(2.5, tile);
  for (int x = tile.max.x; x >= tile.min.x; --x)
    for (int y = tile.min.y; y <= tile.max.y; ++y)
      for (int z = tile.min.z; z <= tile.max.z; ++z) voxels.add(2.5, Coord{x, y, z});
  EXPECT_EQ(whole, voxels);
  EXPECT_EQ(whole.count(), 512u);
}

TEST(InactiveValues, DifferByValueVoxelAndAxis) {
  const InactiveValues values = one(1.0, {1, 2, 3});
  EXPECT_EQ(values, one(1.0, {1, 2, 3}));
  EXPECT_FALSE(values == one(1.5, {1, 2, 3}));
  EXPECT_FALSE(values == one(-1.0, {1, 2, 3}));
  EXPECT_FALSE(values == one(1.0, {3, 2, 1}));
  EXPECT_FALSE(values == one(1.0, {1, 2, 4}));
  EXPECT_FALSE(values == InactiveValues());
  EXPECT_EQ(one(kNan, {}), one(kNan, {}));
  EXPECT_EQ(one(0.0, {}), one(-0.0, {})) << "equal values";
}

TEST(InactiveValues, DifferByComponent) {
  InactiveValues x, y;
  x.add(one(1.0, {}).ofComponent(0));
  y.add(one(1.0, {}).ofComponent(1));
  EXPECT_FALSE(x == y);
}

TEST(InactiveValues, HaveARangeOfTheFiniteOnes) {
  InactiveValues values = one(kNan, {7, 8, 9});
  EXPECT_EQ(values.nonFinite(), 1u);
  values.add(-3.0, Coord{0, 0, 1});
  values.add(one(-2.0, {0, 0, 2}));
  EXPECT_EQ(values.min(), -3.0);
  EXPECT_EQ(values.max(), -2.0);
  EXPECT_EQ(toText(values),
            "3 inactive values (-3 to -2, and 1 NaN or infinite, first at (7, 8, 9))");
  EXPECT_EQ(toText(one(5.0, {1, 2, 3})), "1 inactive value (5, first at (1, 2, 3))");
}

TEST(InactiveValues, OfTheLargestTileAreCounted) {
  InactiveValues values;
  values.add(1.0, Box{{0, 0, 0}, {4095, 4095, 4095}});
  EXPECT_EQ(values.count(), std::uint64_t{1} << 36);
}

}  // namespace
}  // namespace esvr
