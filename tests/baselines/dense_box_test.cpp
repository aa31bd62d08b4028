// Plan: the voxels of a box become an array and a volume again, across bricks and where the box
// cuts bricks. The tests check the order of the array, the active voxels that come back, and the
// limit on memory.

#include "baselines/dense_box.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace esvr::baselines
