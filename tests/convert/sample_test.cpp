// Plan: a sample has bricks of its volume with their values, about as many as wanted, from all over
// the coding order. A small volume is its own sample.

#include "convert/sample.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "convert/volumes.h"

namespace esvr {
namespace {

TEST(Sample, HasBricksOfTheVolumeAtTheirPositions) {
  const SparseVolume volume = test::noiseVolume(6);
  const SparseVolume sample = convert::sampleOf(volume, {.bricks = 24, .runs = 3});
  checkInvariants(sample);
  EXPECT_EQ(sample.brickCount(), 24u);
  EXPECT_EQ(sample.background, volume.background);
  for (std::size_t b = 0; b < sample.brickCount(); ++b) {
    const auto at = findBrick(volume, sample.bricks[b]);
    ASSERT_TRUE(at);
    EXPECT_EQ(sample.brickCorner(b), volume.brickCorner(*at));
    EXPECT_EQ(sample.active[b], volume.active[*at]);
    EXPECT_TRUE(std::ranges::equal(sample.brickValues(b), volume.brickValues(*at)));
  }
}

TEST(Sample, ReachesFromTheFirstToTheLastBrick) {
  const SparseVolume volume = test::noiseVolume(8);
  const SparseVolume sample = convert::sampleOf(volume, {.bricks = 32, .runs = 4});
  EXPECT_EQ(sample.bricks.front(), volume.bricks.front());
  EXPECT_EQ(sample.bricks.back(), volume.bricks.back());
}

TEST(Sample, OfASmallVolumeIsTheVolume) {
  const SparseVolume volume = test::noiseVolume(2);
  EXPECT_EQ(convert::sampleOf(volume, {.bricks = 8, .runs = 2}).values, volume.values);
}

TEST(Sample, OfOneRunIsInTheMiddle) {
  const SparseVolume volume = test::noiseVolume(4);
  const SparseVolume sample = convert::sampleOf(volume, {.bricks = 2, .runs = 1});
  EXPECT_EQ(sample.brickCount(), 2u);
  EXPECT_NE(sample.bricks.front(), volume.bricks.front());
}

}  // namespace
}  // namespace esvr
