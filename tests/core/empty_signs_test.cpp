// Plan: the regions of the empty space are compared with a flood fill of all places in a box, for
// shells with one and with two hollows, a solid, and a shell with a hole through which the inside
// reaches infinity. A place beyond the box is outside. Volumes at negative coordinates give the same.

#include "esvr/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

namespace esvr {
namespace {

constexpr int kSide = 8;  // bricks along an edge of the box

/// True if a voxel of a brick touches a place that is inside through a face of the brick.
bool touchesInside(Coord brick, Coord local, const std::function<bool(Coord)>& isInside) {
  const auto step = [](int at) { return at == 0 ? -1 : at == kBrickSide - 1 ? 1 : 0; };
  const Coord s{step(local.x), step(local.y), step(local.z)};
  return isInside(brick + Coord{s.x, 0, 0}) || isInside(brick + Coord{0, s.y, 0}) ||
         isInside(brick + Coord{0, 0, s.z});
}

/// A volume with bricks where `has` says so. Their slices have the sign of the places beside them.
SparseVolume bricksWhere(Coord shift, const std::function<bool(Coord)>& has,
                         const std::function<bool(Coord)>& isInside) {
  std::vector<BrickInput> bricks;
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y)
      for (int z = 0; z < kSide; ++z) {
        if (!has({x, y, z})) continue;
        BrickInput brick{(Coord{x, y, z} + shift) * kBrickSide, {}, {}};
        brick.active.setAll();
        for (int v = 0; v < kBrickVoxels; ++v)
          brick.values[std::size_t(v)] =
              touchesInside({x, y, z}, voxelLocal(v), isInside) ? -1.0f : 0.0f;
        bricks.push_back(brick);
      }
  return makeVolume(std::move(bricks), 3.0f);
}

bool within(Coord p, int low, int high) {
  return std::min({p.x, p.y, p.z}) >= low && std::max({p.x, p.y, p.z}) <= high;
}

TEST(EmptySigns, AreThoseInsideAndOutsideOfShells) {
  const auto hollow = [](Coord p) { return within(p, 3, 4); };
  for (const Coord shift : {Coord{0, 0, 0}, Coord{-20, -3, 7}}) {
    const SparseVolume shell = bricksWhere(
        shift, [&](Coord p) { return within(p, 2, 5) && !hollow(p); }, hollow);
    const EmptySigns signs(shell);
    EXPECT_TRUE(signs.agree());
    for (int x = -1; x <= kSide; ++x)
      for (int y = -1; y <= kSide; ++y)
        for (int z = -1; z <= kSide; ++z)
          if (const Coord p{x, y, z}; !within(p, 2, 5) || hollow(p)) {
            ASSERT_EQ(signs.isInside(p + shift), hollow(p)) << x << ' ' << y << ' ' << z;
          }
  }
}

TEST(EmptySigns, OfTwoHollowsAreTheirOwn) {
  const auto inside = [](Coord p) { return within(p, 1, 2); };
  const auto cavity = [](Coord p) { return within(p, 5, 6); };  // outside, though enclosed
  const EmptySigns signs(bricksWhere(
      {}, [&](Coord p) { return within(p, 0, 7) && !inside(p) && !cavity(p); }, inside));
  EXPECT_TRUE(signs.agree());
  EXPECT_TRUE(signs.isInside({1, 2, 1}));
  EXPECT_FALSE(signs.isInside({5, 6, 5}));
  EXPECT_FALSE(signs.isInside({100, 2, 1}));
}

TEST(EmptySigns, DisagreeAroundAHole) {
  const auto hollow = [](Coord p) { return within(p, 3, 4); };
  const auto shell = [&](Coord p) { return within(p, 2, 5) && !hollow(p); };
  EXPECT_TRUE(EmptySigns(bricksWhere({}, shell, hollow)).agree());
  for (const Coord hole : {Coord{2, 3, 3}, Coord{3, 5, 4}, Coord{4, 3, 5}})
    EXPECT_FALSE(EmptySigns(bricksWhere(
                                {}, [&](Coord p) { return shell(p) && p != hole; }, hollow))
                     .agree());
}

TEST(EmptySigns, WithoutAHollowAreOutside) {
  const auto solid = [](Coord p) { return within(p, 2, 4); };
  const EmptySigns signs(bricksWhere({}, solid, [](Coord) { return false; }));
  EXPECT_TRUE(signs.agree());
  EXPECT_FALSE(signs.isInside({0, 0, 0}));
  EXPECT_FALSE(EmptySigns(bricksWhere({}, solid, [](Coord) { return true; })).agree());
}

}  // namespace
}  // namespace esvr
