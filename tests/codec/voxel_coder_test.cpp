// Plan: along a line, the activities that are carried over from voxel to voxel are those that are
// gathered from the halo, for random activities. The cells before a brick are those of no voxel.

#include "codec/voxel_coder.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace esvr::codec {
namespace {

Halo randomHalo() {
  std::mt19937 random(3);
  Halo halo{};
  for (bool& active : halo.active) active = random() % 2 == 0;
  return halo;
}

TEST(VoxelHalo, CarriesTheActivitiesAlongALine) {
  const Halo halo = randomHalo();
  for (int x = 0; x < kBrickSide; ++x)
    for (int y = 0; y < kBrickSide; ++y) {
      std::size_t around = halo.activityAround(Halo::cell({x, y, 0}));
      for (int z = 1; z < kBrickSide; ++z) {
        const int cell = Halo::cell({x, y, z});
        const bool before = halo.active[std::size_t(cell - Halo::kStepZ)];
        around = halo.activityAfter(around, before, cell);
        ASSERT_EQ(around, halo.activityAround(cell)) << x << ' ' << y << ' ' << z;
      }
    }
}

TEST(VoxelHalo, VisitsEachCellBeforeTheBrickOnce) {
  std::multiset<std::size_t> visited, wanted;
  Halo::forEachBefore([&](std::size_t cell) { visited.insert(cell); });
  for (std::size_t cell = 0; cell < Halo::kCells; ++cell) wanted.insert(cell);
  for (int v = 0; v < kBrickVoxels; ++v) wanted.erase(std::size_t(Halo::cell(voxelLocal(v))));
  EXPECT_EQ(visited, wanted);
}

}  // namespace
}  // namespace esvr::codec
