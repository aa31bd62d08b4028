// Plan: the bricks of a volume become a stack and a volume again, and their positions become bytes
// and positions again. Bytes that end too early are refused.

#include "baselines/brick_stack.h"

#include <gtest/gtest.h>

#include "esvr/error.h"
#include "metrics/volumes.h"

namespace esvr::baselines {
namespace {

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

}  // namespace
}  // namespace esvr::baselines
