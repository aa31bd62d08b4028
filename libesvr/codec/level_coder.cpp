#include "codec/level_coder.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "codec/brick_coder.h"
#include "codec/brick_order.h"
#include "codec/difference_model.h"
#include "core/axes.h"
#include "core/brick_index.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// The bricks of the previous frame as context, by the number of their neighbours.
class PastLevels {
 public:
  static constexpr std::size_t kKeptContexts = 7, kAddedContexts = 7;

  explicit PastLevels(const LevelBricks& past) : past_(past), index_(past.bricks) {}

  [[nodiscard]] std::size_t count() const { return past_.bricks.size(); }
  [[nodiscard]] Coord brickAt(std::size_t b) const { return past_.bricks[b]; }
  [[nodiscard]] std::uint32_t find(Coord brick) const { return index_.find(brick); }
  [[nodiscard]] std::size_t keptContext(std::size_t b) const {
    return addedContext(past_.bricks[b]);
  }
  [[nodiscard]] std::size_t addedContext(Coord brick) const {
    std::size_t neighbours = 0;
    for (const auto axis : kAxes)
      for (const int step : {-1, 1}) {
        Coord other = brick;
        other.*axis += step;
        neighbours += find(other) != BrickIndex::kNone ? 1 : 0;
      }
    return neighbours;
  }
  [[nodiscard]] const BlockLevels* levelsOf(Coord brick) const {
    const std::uint32_t b = find(brick);
    return b == BrickIndex::kNone ? nullptr : &past_.levels[b];
  }

 private:
  const LevelBricks& past_;
  BrickIndex index_;
};

constexpr int kAxisCount = 3;
constexpr std::size_t kAxisBits[kAxisCount] = {1, 2,
                                               4};  ///< of z, y and x in the number of a block

/// What is known of a block before its level.
struct Around {
  std::optional<int> past;                              ///< level in the previous frame
  std::array<std::optional<int>, kAxisCount> before{};  ///< levels of the blocks below it, by axis
  std::array<bool, kAxisCount> changed{};  ///< whether such a block has another level than before

  /// How many of the blocks below have a level.
  [[nodiscard]] std::size_t countEqual(int level) const {
    return std::size_t(std::ranges::count(before, std::optional(level)));
  }
  [[nodiscard]] std::size_t countChanged() const {
    return std::size_t(std::ranges::count(changed, true));
  }
  /// Which of the blocks below agree: 0 to 4.
  [[nodiscard]] std::size_t agreement() const {
    if (before[0] == before[1]) return before[1] == before[2] ? 0 : 1;
    if (before[0] == before[2]) return 2;
    return before[1] == before[2] ? 3 : 4;
  }
  [[nodiscard]] int mean() const {
    int sum = 0, count = 0;
    for (const auto& level : before)
      if (level) sum += *level, ++count;
    if (count > 0) return (sum + count / 2) / count;
    return past.value_or(kMiddleLevel);
  }
};

template <class Side>
class LevelCoder {
 public:
  LevelCoder(Side& side, const PastLevels& past, LevelBricks& levels)
      : side_(side), past_(past), levels_(levels), index_(levels.bricks) {}

  void code() {
    for (const std::size_t b : codingOrder(levels_.bricks))
      for (std::size_t block = 0; block < kBlocksOfBrick; ++block) {
        std::uint8_t& level = levels_.levels[b].of[block];
        level = codeBlock(block, around(b, block), level);
      }
  }

 private:
  [[nodiscard]] Around around(std::size_t b, std::size_t block) const {
    Around result;
    if (const BlockLevels* past = past_.levelsOf(levels_.bricks[b])) result.past = past->of[block];
    for (std::size_t a = 0; a < kAxisCount; ++a) {
      Coord brick = levels_.bricks[b];
      if ((block & kAxisBits[a]) == 0) brick.*kAxes[kAxisCount - 1 - a] -= 1;
      const std::uint32_t at = index_.find(brick);
      if (at == BrickIndex::kNone) continue;
      const std::size_t other = block ^ kAxisBits[a];
      const int level = levels_.levels[at].of[other];
      result.before[a] = level;
      const BlockLevels* past = past_.levelsOf(brick);
      result.changed[a] = past && past->of[other] != level;
    }
    return result;
  }

  std::uint8_t codeBlock(std::size_t block, const Around& around, int level) {
    if (around.past) {
      const std::size_t equal = around.countEqual(*around.past);
      BitModel& kept = kept_[block == 0][around.countChanged()][equal];
      if (side_.bit(kept, level == *around.past)) return std::uint8_t(*around.past);
    }
    for (std::size_t a = 0; a < kAxisCount; ++a) {
      const std::optional<int> offer = around.before[a];
      if (!offer || offer == around.past || isBefore(around, a, *offer)) continue;
      BitModel& same = same_[around.past.has_value()][block][around.agreement()][a];
      if (side_.bit(same, level == *offer)) return std::uint8_t(*offer);
    }
    const auto difference = differences_.code(side_, 0, 0, std::int64_t(level) - around.mean());
    const std::int64_t coded = around.mean() + difference;
    if (coded < 0 || coded >= kLevelCount) throw BadInput("a level is out of range");
    return std::uint8_t(coded);
  }

  /// True if a level was offered for an axis before.
  static bool isBefore(const Around& around, std::size_t axis, int level) {
    const auto end = around.before.begin() + std::ptrdiff_t(axis);
    return std::find(around.before.begin(), end, std::optional(level)) != end;
  }

  Side& side_;
  const PastLevels& past_;
  LevelBricks& levels_;
  BrickIndex index_;
  std::array<std::array<std::array<BitModel, kAxisCount + 1>, kAxisCount + 1>, 2> kept_;
  std::array<std::array<std::array<std::array<BitModel, kAxisCount>, 5>, kBlocksOfBrick>, 2> same_;
  DifferenceModel differences_;
};

}  // namespace

void codeLevels(Writer& side, const LevelBricks& past, const LevelBricks& levels) {
  const PastLevels set(past);
  LevelBricks written = levels;
  written.bricks =
      BrickCoder<Writer, PastLevels>(side, set, levels.bricks).code(levels.bricks.size());
  LevelCoder<Writer>(side, set, written).code();
}

LevelBricks codeLevels(Reader& side, const LevelBricks& past, std::uint64_t maxNew) {
  const PastLevels set(past);
  LevelBricks levels;
  levels.bricks = BrickCoder<Reader, PastLevels>(side, set, {}).code(maxNew);
  levels.levels.resize(levels.bricks.size());
  LevelCoder<Reader>(side, set, levels).code();
  return levels;
}

std::uint64_t newBricks(const LevelBricks& past, const LevelBricks& levels) {
  const BrickIndex index(past.bricks);
  return std::uint64_t(std::ranges::count_if(
      levels.bricks, [&](Coord brick) { return index.find(brick) == BrickIndex::kNone; }));
}

}  // namespace esvr::codec
