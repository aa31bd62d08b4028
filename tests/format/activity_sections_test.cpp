// Plan: levels come back from a section anywhere in the index space; what cannot be stored is refused,
// and so are damaged sections and those that need too much memory.
#include "format/activity_sections.h"

#include <gtest/gtest.h>

#include "esvr/error.h"

namespace esvr::format {
namespace {

Levels levelsAt(Coord first, int count) {
  Levels levels;
  for (int n = 0; n < count; ++n) {
    levels.bricks.push_back(first + Coord{8 * (n / 4), 8 * (n % 4), 0});
    levels.levels.emplace_back().of.fill(std::uint8_t(n % kLevelCount));
  }
  return levels;
}

Levels readBack(const std::vector<std::byte>& content) {
  MemoryBudget budget(kNoMemoryLimit);
  return getLevels(content, "levels", budget);
}

void expectSame(const Levels& a, const Levels& b) {
  EXPECT_EQ(a.bricks, b.bricks);
  EXPECT_EQ(a.levels, b.levels);
}

TEST(LevelSection, LevelsComeBackAnywhere) {
  constexpr std::int32_t kLow = Box::kMin, kHigh = Box::kMax - 127;
  for (const Coord first : {Coord{}, Coord{-8, 16, -1024}, Coord{kLow, kHigh, kLow}})
    expectSame(readBack(putLevels(levelsAt(first, 40))), levelsAt(first, 40));
  expectSame(readBack(putLevels({})), {});
}

TEST(LevelSection, BricksThatAreFarApartAreRefused) {
  Levels far = levelsAt({}, 1);
  far.bricks.push_back({(1 << 24) - 8, 0, 0});
  far.levels.emplace_back();
  expectSame(readBack(putLevels(far)), far);
  far.bricks.back().x += 8;
  EXPECT_FALSE(areNear(far.bricks));
  EXPECT_THROW((void)putLevels(far), RuntimeFailure);
}

TEST(LevelSection, WhatIsNoListOfBricksIsRefused) {
  Levels levels = levelsAt({}, 3);
  levels.levels.pop_back();
  EXPECT_THROW((void)putLevels(levels), RuntimeFailure);
  levels = levelsAt({4, 0, 0}, 3);
  EXPECT_THROW((void)putLevels(levels), RuntimeFailure);
}

TEST(LevelSection, BricksBeyondTheIndexSpaceAreRefused) {
  auto content = putLevels(levelsAt({}, 5));
  content[3] = std::byte{0x7f};  // the highest byte of the origin's x
  EXPECT_THROW((void)readBack(content), BadInput);
}

TEST(LevelSection, TheMemoryIsCheckedBeforeItIsTaken) {
  MemoryBudget budget(1000);
  EXPECT_THROW((void)getLevels(putLevels(levelsAt({}, 100)), "levels", budget), MemoryExceeded);
}

}  // namespace
}  // namespace esvr::format
