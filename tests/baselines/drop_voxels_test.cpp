// Plan: the tests check which voxels are dropped at a threshold in a fog volume, with a background
// other than 0, and in a level set, whose band becomes narrower from its edge.

#include "baselines/drop_voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metrics/volumes.h"

namespace esvr::baselines {
namespace {

using testing::ElementsAre;

VolumeGrid gridOf(const std::vector<test::Voxel>& voxels, float background,
                  GridClass gridClass = GridClass::kFogVolume) {
  VolumeGrid grid;
  grid.descriptor.gridClass = gridClass;
  grid.descriptor.background = background;
  grid.volume = test::volumeOf(voxels, background);
  return grid;
}

TEST(Thresholds, areTheDistinctDeviationsInOrder) {
  const auto grid = gridOf({{{0, 0, 0}, 1.0f}, {{1, 0, 0}, 0.25f}, {{2, 0, 0}, 1.0f}}, 0.5f);
  EXPECT_THAT(thresholds(grid), ElementsAre(0.25f, 0.5f));
}

TEST(WithoutVoxels, dropsThoseNearTheBackground) {
  const auto grid = gridOf({{{0, 0, 0}, 0.6f}, {{1, 0, 0}, 0.4f}, {{2, 0, 0}, 1.0f}}, 0.5f);
  const auto left = withoutVoxels(grid, 0.2).volume;
  EXPECT_EQ(activeVoxelCount(left), 1u);
  EXPECT_EQ(valueAt(left, {0, 0, 0}), 0.5f);
  EXPECT_EQ(valueAt(left, {2, 0, 0}), 1.0f);
}

TEST(WithoutVoxels, dropsBricksThatAreLeftEmpty) {
  const auto grid = gridOf({{{0, 0, 0}, 0.125f}, {{50, 0, 0}, 1.0f}}, 0.0f);
  const auto left = withoutVoxels(grid, 0.125).volume;
  ASSERT_EQ(left.brickCount(), 1u);
  EXPECT_EQ(left.brickCorner(0), (Coord{48, 0, 0}));
}

TEST(WithoutVoxels, narrowsALevelSetsBandAndKeepsSigns) {
  const auto grid = gridOf({{{0, 0, 0}, -2.75f}, {{1, 0, 0}, 0.5f}, {{2, 0, 0}, 2.75f}}, 3.0f,
                           GridClass::kLevelSet);
  const auto left = withoutVoxels(grid, 0.25).volume;
  EXPECT_EQ(activeVoxelCount(left), 1u);
  EXPECT_EQ(valueAt(left, {0, 0, 0}), -3.0f);
  EXPECT_EQ(valueAt(left, {1, 0, 0}), 0.5f);
  EXPECT_EQ(valueAt(left, {2, 0, 0}), 3.0f);
}

}  // namespace
}  // namespace esvr::baselines
