// The choice of thresholds by which voxels are active.

#include "format/choose_activity.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/quantised.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"

namespace esvr::format {

// ---- One threshold

namespace {

// A bin holds the activities with the same exponent and the same first 7 bits of the mantissa, so
// that the resolution relative to the value is the same from 1e-38 to 1e38.
constexpr int kDroppedBits = 16;

/// Squared error that a better overlap may add, as a share of the error that is there if every
/// voxel is active: 0.004 dB.
constexpr double kAllowedShare = 1e-3;

std::size_t binOf(float activity) { return std::bit_cast<std::uint32_t>(activity) >> kDroppedBits; }
const std::size_t kBins = binOf(std::numeric_limits<float>::max()) + 1;

/// The largest threshold at which all voxels of a bin, and of the bins above it, stay active.
float thresholdBelow(std::size_t bin) {
  if (bin == 0) return 0.0f;
  return std::bit_cast<float>((std::uint32_t(bin) << kDroppedBits) - 1);
}

struct Tally {
  std::uint64_t active = 0, inactive = 0;  ///< voxels, by the source's mask
  double cost = 0.0;                       ///< squared error that making these voxels inactive adds
};

class Histogram {
 public:
  void add(const VoxelRule& rule, float value, float wanted, bool active) {
    const float settled = rule.settled(value);
    const double kept = double(wanted) - settled;
    error_ += kept * kept;
    const float activity = rule.activity(settled);
    if (!(activity > 0.0f)) return;
    Tally& bin = bins_[binOf(activity)];
    ++(active ? bin.active : bin.inactive);
    const double dropped = double(wanted) - rule.inactiveValue(settled);
    bin.cost += dropped * dropped - kept * kept;
  }

  void add(const Histogram& other) {
    error_ += other.error_;
    for (std::size_t k = 0; k < bins_.size(); ++k) {
      bins_[k].active += other.bins_[k].active;
      bins_[k].inactive += other.bins_[k].inactive;
      bins_[k].cost += other.bins_[k].cost;
    }
  }

  [[nodiscard]] ThresholdChoice best(std::uint64_t sourceActive) const {
    Tally kept = total();
    const double allowed = kAllowedShare * error_;
    double cost = 0.0, bestIou = 0.0;
    std::size_t first = 0, last = 0;
    for (std::size_t k = 0; k < bins_.size(); ++k) {
      const double iou = double(kept.active) / double(sourceActive + kept.inactive);
      if (cost <= allowed && iou > bestIou) {
        bestIou = iou;
        first = last = k;
      } else if (cost <= allowed && iou == bestIou && last + 1 == k) {
        last = k;
      }
      kept.active -= bins_[k].active;
      kept.inactive -= bins_[k].inactive;
      cost += bins_[k].cost;
    }
    return {thresholdBelow((first + last) / 2), bestIou, error_};
  }

 private:
  [[nodiscard]] Tally total() const {
    Tally sum;
    for (const Tally& bin : bins_) {
      sum.active += bin.active;
      sum.inactive += bin.inactive;
    }
    return sum;
  }

  double error_ = 0.0;  ///< the squared error if every voxel is active
  std::vector<Tally> bins_ = std::vector<Tally>(kBins);
};

/// Adds the voxels of a brick that lie in a box.
void addBrick(const SparseVolume& source, const VoxelRule& rule, const Box& box, Coord corner,
              std::span<const float> values, Histogram& histogram) {
  const auto b = findBrick(source, brickOf(corner - source.origin));
  const BrickMask inBox = maskOf(box, corner);
  for (int v = 0; v < kBrickVoxels; ++v) {
    if (!inBox.test(v)) continue;
    const float wanted = b ? source.brickValues(*b)[v] : source.background;
    histogram.add(rule, values[v], wanted, b && source.active[*b].test(v));
  }
}

/// Bricks of a batch that are counted by one thread. A histogram takes 0.8 MB.
constexpr std::size_t kBricksOfPart = 1024;

}  // namespace

ThresholdChoice chooseThreshold(const SparseVolume& source, const Field& field,
                                const VoxelRule& rule, const ThresholdPlace& place) {
  // The bricks of a part do not depend on the number of threads, so that sums are the same for any.
  const std::size_t batch = std::min(kBatchBricks, place.bricks.size());
  std::vector<Histogram> parts((batch + kBricksOfPart - 1) / kBricksOfPart);
  forEachBatch(field, place.bricks, [&](const BrickBatch& sums) {
    parallelFor(std::size_t{0}, parts.size(), [&](std::size_t p) {
      const std::size_t end = std::min((p + 1) * kBricksOfPart, sums.size());
      for (std::size_t b = p * kBricksOfPart; b < end; ++b)
        addBrick(source, rule, place.box, sums.corners[b], sums.values(b), parts[p]);
    });
  });
  Histogram whole;
  for (const Histogram& part : parts) whole.add(part);
  return whole.best(activeVoxelCount(source));
}

// ---- The graph of levels

namespace {

/// After this many rounds hardly a level changes.
constexpr int kMaxRounds = 12;

std::array<std::uint8_t, 2> endsOf(const LevelCosts& costs) {
  const auto least = std::min_element(costs.begin(), costs.end());
  const auto last = std::find(costs.rbegin(), costs.rend(), *least);
  return {std::uint8_t(least - costs.begin()), std::uint8_t(costs.rend() - last - 1)};
}

}  // namespace

LevelGraph::LevelGraph(std::span<const Coord> places, std::span<const LevelCosts> costs,
                       double edge)
    : costs_(costs), edge_(edge) {
  constexpr Coord kSteps[kNeighbours] = {{-1, 0, 0}, {1, 0, 0},  {0, -1, 0},
                                         {0, 1, 0},  {0, 0, -1}, {0, 0, 1}};
  const BrickIndex index(places);
  for (std::size_t n = 0; n < places.size(); ++n) {
    const Coord p = places[n];
    auto& near = near_.emplace_back();
    for (int s = 0; s < kNeighbours; ++s) near[std::size_t(s)] = index.find(p + kSteps[s]);
    byColor_[std::size_t((p.x + p.y + p.z) & 1)].push_back(n);
    ends_.push_back(endsOf(costs[n]));
  }
}

double LevelGraph::costOf(std::size_t node, std::uint8_t level, double price,
                          const std::vector<std::uint8_t>& levels) const {
  double edges = 0.0;
  for (const std::uint32_t other : near_[node])
    edges += other != BrickIndex::kNone && levels[other] != level ? edge_ : 0.0;
  return costs_[node][level] + price * edges;
}

/// The best of the own level, those of the neighbours, and the ends of the cheapest levels.
std::uint8_t LevelGraph::best(std::size_t node, double price,
                              const std::vector<std::uint8_t>& levels) const {
  std::uint8_t found = levels[node];
  double least = costOf(node, found, price, levels);
  const auto offer = [&](std::uint8_t level) {
    if (level == found) return;
    const double cost = costOf(node, level, price, levels);
    if (cost < least) least = cost, found = level;
  };
  for (const std::uint32_t other : near_[node])
    if (other != BrickIndex::kNone) offer(levels[other]);
  for (const std::uint8_t end : ends_[node]) offer(end);
  return found;
}

/// True if a neighbour of a node has changed in a round or after it.
bool LevelGraph::isDue(std::size_t node, int round, const std::vector<int>& changes) const {
  return round < 0 || std::ranges::any_of(near_[node], [&](std::uint32_t other) {
           return other != BrickIndex::kNone && changes[other] >= round;
         });
}

void LevelGraph::improve(double price, std::vector<std::uint8_t>& levels) const {
  std::vector<int> changes(levels.size(), -1);  // the last round in which each node has changed
  for (int round = 0; round < kMaxRounds; ++round) {
    std::atomic<bool> changed = false;
    for (const auto& nodes : byColor_)
      parallelFor(std::size_t{0}, nodes.size(), [&](std::size_t n) {
        const std::size_t node = nodes[n];
        if (!isDue(node, round - 1, changes)) return;
        const std::uint8_t level = best(node, price, levels);
        if (level == levels[node]) return;
        levels[node] = level;
        changes[node] = round;
        changed.store(true, std::memory_order_relaxed);
      });
    if (!changed) return;
  }
}

// ---- Levels of blocks

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
