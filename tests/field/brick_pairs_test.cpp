// Plan: the pairs over the bricks of an index are those found by testing every brick against every
// support, in the order of the bricks' coordinates, for supports that are smaller and larger than
// the index. More pairs than 32 bits can number are refused.
#include "field/brick_pairs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "esvr/error.h"
#include "esvr/field.h"
#include "field/gather.h"
#include "field/offsets.h"
#include "field/random_field.h"

namespace esvr {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// Bricks far apart, in random order.
std::vector<Coord> scatteredBricks(std::size_t count) {
  test::Random random(3);
  std::vector<Coord> bricks;
  const auto any = [&] { return std::int32_t(random(-300.0, 300.0)); };
  while (bricks.size() < count) {
    const Coord brick{any(), any(), any()};
    if (std::find(bricks.begin(), bricks.end(), brick) == bricks.end()) bricks.push_back(brick);
  }
  return bricks;
}

void expectAllPairs(const std::vector<Coord>& bricks, const std::vector<Support>& reach) {
  const BrickPairs pairs = pairsWithin(BrickIndex(bricks), reach.size(),
                                       [&](std::size_t i) -> const Support& { return reach[i]; });
  for (std::size_t i = 0; i < reach.size(); ++i) {
    std::vector<Coord> expected, found;
    const Box range = brickRange(reach[i]);
    for (const Coord brick : bricks)
      if (range.contains(brick) && SlabTest(reach[i])(brick)) expected.push_back(brick);
    std::sort(expected.begin(), expected.end());
    for (auto k = pairs.ellipsoidBegin[i]; k != pairs.ellipsoidBegin[i + 1]; ++k) {
      const auto brick =
          std::upper_bound(pairs.brickBegin.begin(), pairs.brickBegin.end(), pairs.pairOf[k]) -
          pairs.brickBegin.begin() - 1;
      found.push_back(bricks[std::size_t(brick)]);
    }
    EXPECT_EQ(found, expected) << i;
  }
}

TEST(BrickPairs, AreThoseOfEveryBrickWithEverySupport) {
  const auto bricks = scatteredBricks(400);
  for (const double smallest : {2.0, 300.0, 1e6})
    expectAllPairs(bricks, supports(test::randomField(
                               {.count = 20, .extent = 500.0, .smallest = smallest, .aspect = 5})));
}

TEST(BrickPairs, OffsetsBeyond32BitsAreRefusedByTheirNumber) {
  std::vector<std::uint32_t> few{3, 0, 2, 0};
  makeOffsets(few);
  EXPECT_EQ(few, (std::vector<std::uint32_t>{0, 3, 3, 5}));
  std::vector<std::uint32_t> many(4, 0x7fffffffu);
  many.back() = 0;
  EXPECT_THAT([&] { makeOffsets(many); }, ThrowsMessage<RuntimeFailure>(HasSubstr("6442450941")));
}

}  // namespace
}  // namespace esvr
