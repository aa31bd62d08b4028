// Plan: every brick belongs to one chunk, and the chunks' boxes fill space. Planes halve the bricks.
// A box that grows ends where coordinates end. A volume whose fit exceeds the memory is divided. The
// ellipsoids of the chunks add up to the wanted number and keep to their limits, equal chunks get
// equal numbers, and where the numbers are the best ones, moving an ellipsoid does not lower the
// error.

#include "fit/chunks/divide.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "volumes.h"

namespace esvr {
namespace {

TEST(DivideBricks, GivesEveryBrickToTheChunkWhoseBoxContainsIt) {
  const SparseVolume volume = test::tubeVolume();
  const auto chunks = divideBricks(volume, 5);
  ASSERT_GT(chunks.size(), 4u);
  std::set<std::uint32_t> seen;
  for (const BrickChunk& chunk : chunks) {
    EXPECT_LE(chunk.bricks.size(), 5u);
    std::uint64_t active = 0;
    for (const std::uint32_t b : chunk.bricks) {
      EXPECT_TRUE(seen.insert(b).second);
      EXPECT_TRUE(chunk.bounds.contains(volume.bricks[b]));
      active += std::uint64_t(volume.active[b].count());
    }
    EXPECT_EQ(active, chunk.activeVoxels);
  }
  EXPECT_EQ(seen.size(), volume.brickCount());
}

TEST(DivideBricks, MakesBoxesThatFillSpaceWithoutOverlap) {
  const auto chunks = divideBricks(test::tubeVolume(), 10);
  for (const Coord place : {Coord{0, 0, 0}, Coord{2, 3, 1}, Coord{-100, 2, 5},
                            Coord{Box::kMax, Box::kMin, 0}, Coord{Box::kMin, 0, Box::kMax}})
    EXPECT_EQ(std::count_if(chunks.begin(), chunks.end(),
                            [&](const BrickChunk& c) { return c.box.contains(place); }),
              1);
}

TEST(DivideBricks, EndsAtSingleBricks) {
  const SparseVolume volume = test::volumeOf({}, 2, 0.0f, [](Coord) { return 1.0f; });
  for (const std::size_t most : {0, 1}) {
    const auto chunks = divideBricks(volume, most);
    ASSERT_EQ(chunks.size(), 8u);
    for (const BrickChunk& chunk : chunks) EXPECT_EQ(chunk.activeVoxels, 512u);
  }
}

/// A volume whose bricks are at these places on the x axis.
SparseVolume columnOf(const std::vector<int>& places) {
  SparseVolume volume;
  for (const int x : places) volume.bricks.push_back({x, 0, 0});
  volume.values.resize(places.size() * kBrickVoxels);
  volume.active.resize(places.size());
  return volume;
}

std::vector<std::size_t> sizesOf(const std::vector<BrickChunk>& chunks) {
  std::vector<std::size_t> sizes;
  for (const BrickChunk& chunk : chunks) sizes.push_back(chunk.bricks.size());
  return sizes;
}

TEST(DivideBricks, HalvesTheBricks) {
  using testing::ElementsAre;
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2, 3, 4, 5, 6, 7}), 4)), ElementsAre(4, 4));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2}), 2)), ElementsAre(1, 2));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1'000'000}), 1)), ElementsAre(1, 1));
  EXPECT_THAT(sizesOf(divideBricks(columnOf({0, 1, 2, 100'000'000}), 2)), ElementsAre(2, 2));
}

TEST(DivideBricks, PutsThePlaneWhereBothSidesAreNearlyEqual) {
  SparseVolume volume;  // six bricks at 0, one at 1 and one at 2
  for (int y = 0; y < 6; ++y) volume.bricks.push_back({0, y % 2, y / 2});
  volume.bricks.push_back({1, 0, 0});
  volume.bricks.push_back({9, 0, 0});
  volume.values.resize(8 * kBrickVoxels);
  volume.active.resize(8);
  EXPECT_THAT(sizesOf(divideBricks(volume, 7)), testing::ElementsAre(6, 2));
}

TEST(Dilated, EndsWhereCoordinatesEnd) {
  const Box all = dilated(Box::whole(), 3);
  EXPECT_EQ(all, Box::whole());
  EXPECT_EQ(dilated({{1, 2, 3}, {4, 5, 6}}, 2), (Box{{-1, 0, 1}, {6, 7, 8}}));
}

/// A row of bricks whose voxels are all active.
SparseVolume rowOfBricks(std::int32_t count) {
  SparseVolume volume;
  for (std::int32_t x = 0; x < count; ++x) volume.bricks.push_back({x, 0, 0});
  volume.active.resize(volume.brickCount());
  for (BrickMask& mask : volume.active) mask.setAll();
  volume.values.assign(volume.brickCount() * kBrickVoxels, 1.0f);
  return volume;
}

// A fit takes about 8 KB of the host's memory for each brick (divide.cpp).
TEST(ChunksFor, DividesAVolumeWhoseFitExceedsTheMemoryOfTheHost) {
  const SparseVolume volume = rowOfBricks(2000);
  FitOptions options;
  options.count = 100;
  EXPECT_LE(chunksFor(volume, options).size(), 1u);
  options.maxHostBytes = 20'000'000;
  EXPECT_LE(chunksFor(volume, options).size(), 1u);
  options.maxHostBytes = 9'500'000;
  EXPECT_EQ(chunksFor(volume, options).size(), 2u);
}

std::size_t sumOf(const std::vector<std::size_t>& numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), std::size_t{0});
}

TEST(DivideCount, GivesEqualChunksEqualNumbers) {
  const std::vector<ChunkNeed> needs(4, {2.0, 10.0, 0, 1000});
  EXPECT_EQ(dividedCount(100, needs), (std::vector<std::size_t>{25, 25, 25, 25}));
  EXPECT_EQ(sumOf(dividedCount(101, needs)), 101u);
}

TEST(DivideCount, LowersTheErrorThatFallsWith45DbPerDoubling) {
  const std::vector<ChunkNeed> needs{{1.0, 100.0, 0, 100000}, {50.0, 100.0, 0, 100000}};
  const auto numbers = dividedCount(10000, needs);
  const auto errorOf = [&](double first, double second) {
    const double power = 0.45 / std::log10(2.0);
    return needs[0].error * std::pow(first / 100.0, -power) +
           needs[1].error * std::pow(second / 100.0, -power);
  };
  const double a = double(numbers[0]), b = double(numbers[1]);
  EXPECT_LT(errorOf(a, b), errorOf(a + 100.0, b - 100.0));
  EXPECT_LT(errorOf(a, b), errorOf(a - 100.0, b + 100.0));
}

TEST(DivideCount, KeepsToTheLimits) {
  const std::vector<ChunkNeed> needs{
      {1.0, 10.0, 70, 1000}, {1.0, 10.0, 0, 5}, {1.0, 10.0, 0, 1000}};
  const auto numbers = dividedCount(100, needs);
  EXPECT_EQ(numbers, (std::vector<std::size_t>{70, 5, 25}));
}

TEST(DivideCount, GivesNothingToChunksWithoutError) {
  const std::vector<ChunkNeed> needs{{0.0, 10.0, 0, 1000}, {1.0, 10.0, 0, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{0, 50}));
}

TEST(DivideCount, KeepsMoreThanTheCountWhereChunksHaveThem) {
  const std::vector<ChunkNeed> needs{{1.0, 30.0, 30, 1000}, {1.0, 30.0, 30, 1000}};
  EXPECT_EQ(dividedCount(50, needs), (std::vector<std::size_t>{30, 30}));
}

}  // namespace
}  // namespace esvr
