// Plan: each voxel of a brick lies in the block of its coordinates; the thresholds are those of the
// formula in float64.
#include "esvr/block_levels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esvr {
namespace {

TEST(BlockLevels, EachVoxelLiesInTheBlockOfItsCoordinates) {
  for (int v = 0; v < kBrickVoxels; ++v) {
    const Coord at = voxelLocal(v);
    EXPECT_EQ(blockOf(v), (at.x / 4 * 2 + at.y / 4) * 2 + at.z / 4) << v;
  }
  BlockLevels levels;
  levels.of[5] = 17;
  EXPECT_EQ(levels.at(voxelOffset({4, 3, 7})), 17);
  EXPECT_EQ(levels.at(voxelOffset({4, 4, 7})), 0);
}

// A root is rounded once, and so is its product with the base: two half units in the last place.
TEST(BlockLevels, AThresholdDoublesEveryFourLevels) {
  for (const float base : {1.0f, 0.37f, 3e-9f, 5e20f})
    for (int level = 0; level < kLevelCount; ++level) {
      const double expected = double(base) * std::exp2(level / 4.0);
      EXPECT_NEAR(thresholdAt(base, level), expected, expected * 0x1p-23) << base << ", " << level;
    }
}

}  // namespace
}  // namespace esvr
