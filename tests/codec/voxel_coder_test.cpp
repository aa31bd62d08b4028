// Plan: every cell before a brick is visited once, with the voxel that it stands for.

#include "codec/voxel_coder.h"

#include <gtest/gtest.h>

#include <set>

namespace esvr::codec {
namespace {

/// Bricks 0 to 6 are the bricks before one, and their numbers are those of Halo::Before.
constexpr Halo::Before kBefore{0, 1, 2, 3, 4, 5, 6};

TEST(VoxelHalo, VisitsEachCellBeforeTheBrickOnce) {
  std::multiset<std::size_t> visited, wanted;
  Halo::forEachLine(kBefore, [&](std::size_t cell, std::uint32_t, int, int count) {
    for (int n = 0; n < count; ++n) visited.insert(cell + std::size_t(n));
  });
  for (std::size_t cell = 0; cell < Halo::kCells; ++cell) wanted.insert(cell);
  for (int v = 0; v < kBrickVoxels; ++v) wanted.erase(std::size_t(Halo::cell(voxelLocal(v))));
  EXPECT_EQ(visited, wanted);
}

TEST(VoxelHalo, CopiesTheVoxelsBeforeTheBrick) {
  VoxelLayer layer;
  for (std::uint32_t b = 0; b < kBefore.size(); ++b) {
    layer.bricks.push_back(Halo::stepTo(b) + Coord{1, 1, 1});
    for (int v = 0; v < kBrickVoxels; ++v)
      layer.codes.push_back(std::int32_t(b) * kBrickVoxels + v);
  }
  Halo halo{};
  halo.fillCodes(layer, kBefore, -1);
  for (std::size_t n = 0; n < kBefore.size(); ++n)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord place = Halo::stepTo(n) * kBrickSide + voxelLocal(v);
      if (place.x < -1 || place.y < -1 || place.z < -1) continue;
      ASSERT_EQ(halo.code[std::size_t(Halo::cell(place))], std::int32_t(n) * kBrickVoxels + v);
    }
  Halo::Before none;
  none.fill(BrickIndex::kNone);
  halo.fillCodes(layer, none, -1);
  EXPECT_EQ(halo.code[std::size_t(Halo::cell({-1, 3, 4}))], -1);
}

}  // namespace
}  // namespace esvr::codec
