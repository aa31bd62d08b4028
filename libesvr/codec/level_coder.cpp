#include "codec/level_coder.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <utility>

#include "codec/brick_coder.h"
#include "core/brick_index.h"
#include "core/geometry.h"
#include "esvr/error.h"

namespace esvr::codec {
namespace {

/// The empty set of bricks as context for the bricks with levels.
struct NoBricks {
  static constexpr std::size_t kKeptContexts = 1, kAddedContexts = 1;

  [[nodiscard]] static std::size_t count() { return 0; }
  [[nodiscard]] static Coord brickAt(std::size_t) { return {}; }
  [[nodiscard]] static std::uint32_t find(Coord) { return BrickIndex::kNone; }
  [[nodiscard]] static std::size_t keptContext(std::size_t) { return 0; }
  [[nodiscard]] static std::size_t addedContext(Coord) { return 0; }
};

constexpr int kAxisCount = 3;
constexpr std::size_t kAxisBits[kAxisCount] = {1, 2,
                                               4};  ///< of z, y and x in the number of a block

/// What is known of a block before its level: those of the blocks below it, by axis.
struct Around {
  std::array<std::optional<int>, kAxisCount> before{};

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
    return count > 0 ? (sum + count / 2) / count : kMiddleLevel;
  }
  /// True if an axis before this one has the same level.
  [[nodiscard]] bool isRepeated(std::size_t axis) const {
    const auto own = before.begin() + std::ptrdiff_t(axis);
    return std::find(before.begin(), own, *own) != own;
  }
};

/// Codes signed numbers, most of which are small.
template <class Side>
class DifferenceCoder {
 public:
  explicit DifferenceCoder(Side& side) : side_(side) {}

  std::int64_t code(std::int64_t difference) {
    if (!side_.bit(differs_, difference != 0)) return 0;
    const bool negative = side_.bit(negative_, difference < 0);
    const std::uint64_t magnitude = codeMagnitude(std::uint64_t(std::abs(difference)));
    if (magnitude > kLevelCount) throw BadInput("a level is out of range");
    return negative ? -std::int64_t(magnitude) : std::int64_t(magnitude);
  }

 private:
  static constexpr std::uint64_t kUnary = 3;  // decisions of a magnitude before its rest

  /// Codes a number above 0: whether it is above 1, 2 and 3, and the rest.
  std::uint64_t codeMagnitude(std::uint64_t magnitude) {
    for (std::uint64_t n = 1; n <= kUnary; ++n)
      if (!side_.bit(above_[n - 1], magnitude > n)) return n;
    return kUnary + 1 + rest_.code(side_, magnitude - kUnary - 1);
  }

  Side& side_;
  BitModel differs_, negative_;
  std::array<BitModel, kUnary> above_;
  NumberModelOf<6> rest_;
};

template <class Side>
class LevelCoder {
 public:
  LevelCoder(Side& side, LevelBricks& levels)
      : side_(side), levels_(levels), index_(levels.bricks), differences_(side) {}

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
    for (std::size_t a = 0; a < kAxisCount; ++a) {
      Coord brick = levels_.bricks[b];
      if ((block & kAxisBits[a]) == 0) brick.*kAxes[kAxisCount - 1 - a] -= 1;
      const std::uint32_t at = index_.find(brick);
      if (at != BrickIndex::kNone) result.before[a] = levels_.levels[at].of[block ^ kAxisBits[a]];
    }
    return result;
  }

  std::uint8_t codeBlock(std::size_t block, const Around& around, int level) {
    for (std::size_t a = 0; a < kAxisCount; ++a) {
      const std::optional<int> offer = around.before[a];
      if (!offer || around.isRepeated(a)) continue;
      BitModel& same = same_[block][around.agreement()][a];
      if (side_.bit(same, level == *offer)) return std::uint8_t(*offer);
    }
    const std::int64_t coded =
        around.mean() + differences_.code(std::int64_t(level) - around.mean());
    if (coded < 0 || coded >= kLevelCount) throw BadInput("a level is out of range");
    return std::uint8_t(coded);
  }

  Side& side_;
  LevelBricks& levels_;
  BrickIndex index_;
  std::array<std::array<std::array<BitModel, kAxisCount>, 5>, kBlocksOfBrick> same_;
  DifferenceCoder<Side> differences_;
};

}  // namespace

void codeLevels(Writer& side, const LevelBricks& levels) {
  LevelBricks written = levels;
  written.bricks =
      BrickCoder<Writer, NoBricks>(side, NoBricks{}, levels.bricks).code(levels.bricks.size());
  LevelCoder<Writer>(side, written).code();
}

LevelBricks codeLevels(Reader& side, std::uint64_t maxBricks) {
  LevelBricks levels;
  levels.bricks = BrickCoder<Reader, NoBricks>(side, NoBricks{}, {}).code(maxBricks);
  levels.levels.resize(levels.bricks.size());
  LevelCoder<Reader>(side, levels).code();
  return levels;
}

}  // namespace esvr::codec
