// Plan: the voxels of a box become an array and a volume again, across bricks and where the box cuts
// bricks. The tests check the order of the array, the active voxels that come back, and the limit on memory.
// The bricks of a volume become a stack and a volume again, and their positions become bytes and positions
// again. Bytes that end too early are refused. Voxels are dropped at a threshold in a fog volume, with a
// background other than 0, and in a level set, whose band becomes narrower from its edge.

#include "baselines/voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "esvr/baseline.h"
#include "esvr/error.h"
#include "metrics/volumes.h"

namespace esvr::baselines {
namespace {

constexpr Box kBox{{-5, 3, 6}, {12, 9, 20}};  // cuts bricks on all sides

TEST(DenseBox, hasXFastest) {
  const auto volume = test::volumeOf({{{-4, 3, 6}, 1.0f}, {{-5, 4, 6}, 2.0f}, {{-5, 3, 7}, 3.0f}});
  const DenseBox dense = densify(volume, kBox, 0);
  ASSERT_EQ(dense.values.size(), 18u * 7 * 15);
  EXPECT_EQ(dense.values[1], 1.0f);
  EXPECT_EQ(dense.values[18], 2.0f);
  EXPECT_EQ(dense.values[18 * 7], 3.0f);
}

TEST(DenseBox, comesBackAsItWas) {
  const auto volume = test::randomVolume({.seed = 3, .brickShare = 0.5, .background = 0.25f});
  const SparseVolume back = sparsify(densify(volume, kBox, 0), 0.25f, 0.0f);
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z)
        ASSERT_EQ(valueAt(back, {x, y, z}), valueAt(volume, {x, y, z}));
  EXPECT_EQ(valueAt(back, {kBox.max.x + 1, 5, 8}), 0.25f) << "nothing beyond the box";
  EXPECT_NO_THROW(checkInvariants(back));
}

TEST(DenseBox, makesVoxelsActiveBeyondAThreshold) {
  DenseBox dense{kBox, std::vector<float>(18 * 7 * 15, 0.0f)};
  dense.values[0] = 0.1f;
  dense.values[1] = -0.3f;
  const SparseVolume back = sparsify(dense, 0.0f, 0.2f);
  EXPECT_EQ(activeVoxelCount(back), 1u);
  EXPECT_EQ(valueAt(back, kBox.min), 0.1f) << "inactive voxels keep their values";
}

TEST(DenseBox, isRefusedBeyondItsBound) {
  const auto volume = test::volumeOf({{{0, 3, 6}, 1.0f}});
  EXPECT_NO_THROW((void)densify(volume, kBox, 18 * 7 * 15 * 4));
  EXPECT_THROW((void)densify(volume, kBox, 18 * 7 * 15 * 4 - 1), UsageError);
}

TEST(ActivityThreshold, isHalfTheSmallestDifference) {
  EXPECT_EQ(activityThreshold(test::volumeOf({{{0, 0, 0}, 0.5f}, {{1, 0, 0}, -0.25f}})), 0.125f);
  EXPECT_EQ(activityThreshold(test::volumeOf({{{0, 0, 0}, 0.0f}})), 0.0f);
}

TEST(BrickStack, comesBackAsItWas) {
  const auto volume = test::randomVolume({.seed = 4, .brickShare = 0.4, .background = 0.25f});
  const SparseVolume stack = stackBricks(volume);
  EXPECT_NO_THROW(checkInvariants(stack));
  const SparseVolume back = unstackBricks(stack, volume.bricks, volume.origin);
  EXPECT_EQ(back.origin, volume.origin);
  EXPECT_EQ(back.bricks, volume.bricks);
  EXPECT_EQ(back.values, volume.values);
}

TEST(BrickStack, hasRowsThatZfpAllows) {
  for (const std::size_t bricks : {1, 8192, 8193, 1'000'000}) {
    const StackShape shape = stackShape(bricks);
    EXPECT_LE(shape.box().max.z, 65535);
    EXPECT_GE(shape.rows * shape.length, bricks);
    EXPECT_LT(shape.rows * shape.length, bricks + shape.rows) << "less than a brick in each row";
  }
  std::vector<BrickInput> many(8193);
  for (int b = 0; b < 8193; ++b) {
    many[b] = {.corner = {0, 8 * b, 0}, .values = {float(b)}, .active = {}};
    many[b].active.set(0);
  }
  const SparseVolume volume = makeVolume(std::move(many), 0.0f);
  const SparseVolume stack = stackBricks(volume);
  EXPECT_EQ(activeBox(stack).max.y, kBrickSide) << "two rows";
  EXPECT_EQ(unstackBricks(stack, volume.bricks, volume.origin).bricks, volume.bricks);
}

TEST(BrickStack, mayLackBricks) {
  const auto volume = test::volumeOf({{{0, 0, 0}, 1.0f}, {{8, 0, 0}, 2.0f}, {{24, 0, 0}, 3.0f}});
  SparseVolume stack = stackBricks(volume);
  stack.bricks.erase(stack.bricks.begin() + 1);
  stack.active.erase(stack.active.begin() + 1);
  stack.values.erase(stack.values.begin() + kBrickVoxels, stack.values.begin() + 2 * kBrickVoxels);
  const SparseVolume back = unstackBricks(stack, volume.bricks, volume.origin);
  EXPECT_EQ(valueAt(back, {24, 0, 0}), 3.0f);
  EXPECT_EQ(valueAt(back, {8, 0, 0}), 0.0f);
}

TEST(BrickPositions, comeBackAndTakeAByteInAColumn) {
  const std::vector<Coord> bricks{{0, 0, 0}, {0, 0, 1}, {0, 0, 300}, {0, 7, 2}, {5, 0, 1 << 28}};
  const auto bytes = encodeBricks(bricks);
  std::span<const std::byte> rest = bytes;
  EXPECT_EQ(decodeBricks(rest), bricks);
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(encodeBricks(std::span(bricks).first(2)).size(), 3u) << "the number and two gaps";
}

TEST(BrickPositions, areRefusedIfTheyEndTooEarly) {
  const auto bytes = encodeBricks(std::vector<Coord>{{0, 0, 0}, {3, 1, 2}});
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::span<const std::byte> some = std::span(bytes).first(n);
    EXPECT_THROW((void)decodeBricks(some), BadInput) << n;
  }
}

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
  EXPECT_THAT(thresholds(grid), testing::ElementsAre(0.25f, 0.5f));
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
