// Plan: levels come back; equal levels take hardly any bytes; damaged streams give levels in range or
// are refused.
#include "codec/level_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// A ball of bricks whose levels rise along x, with deviations here and there.
LevelBricks ball(int radius, unsigned seed) {
  LevelBricks levels;
  std::mt19937 random(seed);
  for (int x = 0; x <= 2 * radius; ++x)
    for (int y = 0; y <= 2 * radius; ++y)
      for (int z = 0; z <= 2 * radius; ++z) {
        const int dx = x - radius, dy = y - radius, dz = z - radius;
        if (dx * dx + dy * dy + dz * dz > radius * radius) continue;
        levels.bricks.push_back({x, y, z});
        BlockLevels& own = levels.levels.emplace_back();
        for (auto& level : own.of)
          level = std::uint8_t(random() % 8 == 0 ? random() % kLevelCount : 20 + x / 2);
      }
  return levels;
}

std::vector<std::byte> encoded(const LevelBricks& levels) {
  Writer side;
  codeLevels(side, levels);
  return side.coder.finish();
}

LevelBricks decoded(std::span<const std::byte> bytes, std::uint64_t maxBricks = 100'000) {
  Reader side{RangeDecoder(bytes)};
  return codeLevels(side, maxBricks);
}

void expectSame(const LevelBricks& a, const LevelBricks& b) {
  EXPECT_EQ(a.bricks, b.bricks);
  EXPECT_EQ(a.levels, b.levels);
}

TEST(LevelCoder, LevelsComeBack) {
  expectSame(decoded(encoded({})), {});
  for (unsigned seed = 1; seed < 4; ++seed) {
    const LevelBricks levels = ball(4, seed);
    expectSame(decoded(encoded(levels)), levels);
  }
}

// A model that has seen n equal decisions takes about 2 log2(n) bits for all of them together. There are
// at most 8 * 5 * 3 such models here; the positions of the bricks take the rest.
TEST(LevelCoder, EqualLevelsTakeHardlyAnyBytes) {
  LevelBricks levels = ball(8, 3);
  ASSERT_GT(encoded(levels).size(), 3000u);
  for (BlockLevels& own : levels.levels) own.of.fill(30);
  EXPECT_LT(encoded(levels).size(), 600u);
}

TEST(LevelCoder, MoreBricksThanAllowedAreRefused) {
  const LevelBricks levels = ball(3, 1);
  const auto bytes = encoded(levels);
  expectSame(decoded(bytes, levels.bricks.size()), levels);
  EXPECT_THROW((void)decoded(bytes, levels.bricks.size() - 1), BadInput);
}

TEST(LevelCoder, DamagedBytesGiveLevelsInRangeOrAreRefused) {
  const LevelBricks levels = ball(3, 2);
  const auto whole = encoded(levels);
  std::mt19937 random(5);
  int refused = 0;
  for (int n = 0; n < 300; ++n) {
    auto bytes = whole;
    bytes[random() % bytes.size()] ^= std::byte(1 + random() % 255);
    try {
      const LevelBricks read = decoded(bytes, 1000);
      EXPECT_TRUE(std::ranges::is_sorted(read.bricks));
      for (const BlockLevels& own : read.levels)
        EXPECT_TRUE(std::ranges::all_of(own.of, [](auto l) { return l < kLevelCount; }));
    } catch (const BadInput&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace esvr::codec
