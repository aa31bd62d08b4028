#include "format/choose_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "esvr/simplified_mask.h"
#include "field/active_region.h"
#include "field/brick_batches.h"
#include "format/level_graph.h"

namespace esvr::format {
namespace {

/// An overlap exceeds kMinOverlap by this, so that rounding on another machine does not matter.
constexpr double kOverlapMargin = 1e-4;

/// What an edge between bricks is worth, as a multiple of one between blocks (docs/lab-notes.md,
/// "Thresholds of blocks").
constexpr double kEdgeOfBricks = 0.5;

// The price of an edge, in voxels in the wrong state: a high one gives few bytes and a small overlap.
constexpr double kFirstPrice = 4.0, kHighestPrice = 16.0, kLowestPrice = 0.1, kPriceFactor = 2.0;
/// Halvings of the interval, on a log scale, between a price that suffices and one that does not.
constexpr int kPriceBisections = 3;

/// The voxels of a block by their number of levels at which they are active.
struct BlockCounts {
  std::array<std::uint8_t, kLevelCount + 1> active{}, inactive{};  ///< by the state in the source
};

/// The costs and the voxels of the blocks of some bricks.
struct BlockTally {
  std::vector<Coord> bricks;  ///< coordinates of the bricks
  std::vector<LevelCosts> costs;
  std::vector<BlockCounts> counts;
};

class BlockCounter {
 public:
  explicit BlockCounter(const LevelTask& task) : task_(task) {
    for (int k = 0; k < kLevelCount; ++k) thresholds_[std::size_t(k)] = thresholdAt(task.base, k);
  }

  BlockTally run() {
    const auto& corners = task_.place.bricks;
    tally_.costs.resize(corners.size() * kBlocksOfBrick);
    tally_.counts.resize(corners.size() * kBlocksOfBrick);
    for (const Coord corner : corners) tally_.bricks.push_back(brickOf(corner));
    std::size_t first = 0;
    forEachBatch(task_.field, corners, [&](const BrickBatch& sums) {
      parallelFor(std::size_t{0}, sums.size(),
                  [&](std::size_t b) { count(sums.corners[b], sums.values(b), first + b); });
      first += sums.size();
    });
    return std::move(tally_);
  }

 private:
  struct SourceBrick {
    const float* values = nullptr;
    const BrickMask* active = nullptr;
    [[nodiscard]] bool isActive(int v) const { return active && active->test(v); }
  };

  [[nodiscard]] SourceBrick sourceAt(Coord corner) const {
    const auto b = findBrick(task_.source, brickOf(corner - task_.source.origin));
    if (!b) return {};
    return {task_.source.brickValues(*b).data(), &task_.source.active[*b]};
  }

  /// The number of levels at which a value is active: those below this number.
  [[nodiscard]] int levelsOf(float settled) const {
    const float activity = task_.rule.activity(settled);
    return int(std::lower_bound(thresholds_.begin(), thresholds_.end(), activity) -
               thresholds_.begin());
  }

  void count(Coord corner, std::span<const float> sums, std::size_t brick) {
    const BrickMask inBox = maskOf(task_.place.box, corner);
    const SourceBrick source = sourceAt(corner);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!inBox.test(v)) continue;
      const std::size_t block = brick * kBlocksOfBrick + std::size_t(blockOf(v));
      const float settled = task_.rule.settled(sums[std::size_t(v)]);
      const int levels = levelsOf(settled);
      const double wanted = source.values ? source.values[v] : task_.source.background;
      auto& counts = tally_.counts[block];
      ++(source.isActive(v) ? counts.active : counts.inactive)[std::size_t(levels)];
      addCost(source.isActive(v), levels, gainOf(wanted, settled), tally_.costs[block]);
    }
  }

  /// What a voxel gains by being active, in squared errors.
  [[nodiscard]] double gainOf(double wanted, float settled) const {
    const double kept = wanted - settled, dropped = wanted - task_.rule.inactiveValue(settled);
    return (dropped * dropped - kept * kept) / (task_.error * task_.error);
  }

  static void addCost(bool active, int levels, double gain, LevelCosts& costs) {
    const auto cost = float(1.0 + std::max(active ? gain : -gain, 0.0));
    if (active)
      for (int k = levels; k < kLevelCount; ++k) costs[std::size_t(k)] += cost;
    else
      for (int k = 0; k < levels; ++k) costs[std::size_t(k)] += cost;
  }

  const LevelTask& task_;
  std::array<float, kLevelCount> thresholds_{};
  BlockTally tally_;
};

std::vector<LevelCosts> costsOfBricks(const BlockTally& tally) {
  std::vector<LevelCosts> costs(tally.bricks.size());
  for (std::size_t i = 0; i < tally.costs.size(); ++i)
    for (std::size_t k = 0; k < kLevelCount; ++k) costs[i / kBlocksOfBrick][k] += tally.costs[i][k];
  return costs;
}

std::vector<Coord> placesOfBlocks(const BlockTally& tally) {
  std::vector<Coord> places;
  for (const Coord brick : tally.bricks)
    for (int n = 0; n < kBlocksOfBrick; ++n)
      places.push_back(brick * kBlocksAlong + Coord{n / (kBlocksAlong * kBlocksAlong),
                                                    n / kBlocksAlong % kBlocksAlong,
                                                    n % kBlocksAlong});
  return places;
}

/// Solves for the levels of bricks first, so that the blocks of a brick differ only where it pays.
class LevelSearch {
 public:
  LevelSearch(const LevelTask& task, const BlockTally& tally)
      : tally_(tally),
        sourceActive_(activeVoxelCount(task.source)),
        brickCosts_(costsOfBricks(tally)),
        bricks_(tally.bricks, brickCosts_, kEdgeOfBricks),
        blocks_(placesOfBlocks(tally), tally.costs, 1.0) {}

  std::optional<Levels> run() {
    double low = 0.0, high = 0.0;  // prices that suffice and do not; 0: none is known
    std::optional<std::vector<std::uint8_t>> found;
    int bisections = 0;
    for (double price = kFirstPrice; bisections <= kPriceBisections;) {
      auto now = sufficient(price);
      (now ? low : high) = price;
      if (now) found = std::move(now);
      if (low > 0.0 && high > 0.0) {
        price = std::sqrt(low * high);
        ++bisections;
      } else if (price < kLowestPrice || price > kHighestPrice) {
        break;
      } else {
        price *= low > 0.0 ? kPriceFactor : 1.0 / kPriceFactor;
      }
    }
    return found ? std::optional(levelsOf(*found)) : std::nullopt;
  }

 private:
  /// The levels of the blocks at a price, if they suffice.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> sufficient(double price) const {
    std::vector<std::uint8_t> ofBricks(tally_.bricks.size(), kMiddleLevel);
    bricks_.improve(price, ofBricks);
    std::vector<std::uint8_t> levels(tally_.costs.size());
    for (std::size_t i = 0; i < levels.size(); ++i) levels[i] = ofBricks[i / kBlocksOfBrick];
    blocks_.improve(price, levels);
    if (!(overlapOf(levels).iou() > kMinOverlap + kOverlapMargin)) return std::nullopt;
    return levels;
  }

  [[nodiscard]] MaskOverlap overlapOf(const std::vector<std::uint8_t>& levels) const {
    MaskOverlap overlap{0, sourceActive_};
    for (std::size_t i = 0; i < levels.size(); ++i)
      for (std::size_t n = levels[i] + std::size_t{1}; n <= kLevelCount; ++n) {
        overlap.both += tally_.counts[i].active[n];
        overlap.either += tally_.counts[i].inactive[n];
      }
    return overlap;
  }

  /// The bricks that have active voxels, and their levels.
  [[nodiscard]] Levels levelsOf(const std::vector<std::uint8_t>& levels) const {
    Levels result;
    for (std::size_t b = 0; b < tally_.bricks.size(); ++b) {
      BlockLevels own;
      bool any = false;
      for (std::size_t n = 0; n < kBlocksOfBrick; ++n) {
        const std::size_t i = b * kBlocksOfBrick + n;
        own.of[n] = levels[i];
        any = any || isAnyActive(tally_.counts[i], levels[i]);
      }
      if (!any) continue;
      result.bricks.push_back(tally_.bricks[b] * kBrickSide);
      result.levels.push_back(own);
    }
    return result;
  }

  static bool isAnyActive(const BlockCounts& counts, std::uint8_t level) {
    for (std::size_t n = level + std::size_t{1}; n <= kLevelCount; ++n)
      if (counts.active[n] + counts.inactive[n] > 0) return true;
    return false;
  }

  const BlockTally& tally_;
  std::uint64_t sourceActive_;
  std::vector<LevelCosts> brickCosts_;
  LevelGraph bricks_, blocks_;
};

}  // namespace

std::optional<Levels> chooseLevels(const LevelTask& task) {
  const BlockTally tally = BlockCounter(task).run();
  return LevelSearch(task, tally).run();
}

}  // namespace esvr::format
