// Plan: where errors differ from place to place, a threshold for each block restores the active voxels
// and one for all does not; the choice is the same for any number of threads; active voxels that do not
// depend on the values have no thresholds.
//
// In the graph of levels, without a price, each node has its cheapest level; with a high one, all agree; the sum of
// costs never grows, and at the end no single change reduces it.

#include "format/choose_activity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "field/random_field.h"
#include "support/on_threads.h"

namespace esvr::format {
namespace {

constexpr int kSide = 5;

struct Nodes {
  std::vector<Coord> places;
  std::vector<LevelCosts> costs;
};

/// A cube of nodes with random costs, which rise on both sides of a random level.
Nodes randomNodes(unsigned seed) {
  Nodes nodes;
  std::mt19937 random(seed);
  for (int n = 0; n < kSide * kSide * kSide; ++n) {
    nodes.places.push_back({n / (kSide * kSide), n / kSide % kSide, n % kSide});
    const int best = int(random() % kLevelCount);
    auto& costs = nodes.costs.emplace_back();
    for (int k = 0; k < kLevelCount; ++k) costs[std::size_t(k)] = float(std::abs(k - best));
  }
  return nodes;
}

bool touch(Coord a, Coord b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z) == 1;
}

/// The sum of the costs by definition, edges with weight 1.
double sumOf(const Nodes& nodes, double price, const std::vector<std::uint8_t>& levels) {
  double sum = 0.0;
  for (std::size_t a = 0; a < levels.size(); ++a) {
    sum += nodes.costs[a][levels[a]];
    for (std::size_t b = 0; b < a; ++b)
      if (touch(nodes.places[a], nodes.places[b]) && levels[a] != levels[b]) sum += price;
  }
  return sum;
}

TEST(LevelGraph, WithoutAPriceEachNodeHasItsCheapestLevel) {
  const Nodes nodes = randomNodes(1);
  const LevelGraph graph(nodes.places, nodes.costs, 1.0);
  std::vector<std::uint8_t> levels(nodes.places.size(), kMiddleLevel);
  graph.improve(0.0, levels);
  for (std::size_t n = 0; n < levels.size(); ++n) EXPECT_EQ(nodes.costs[n][levels[n]], 0.0f);
}

TEST(LevelGraph, AtAHighPriceAllNodesStayEqual) {
  const Nodes nodes = randomNodes(2);
  const LevelGraph graph(nodes.places, nodes.costs, 1.0);
  std::vector<std::uint8_t> levels(nodes.places.size(), kMiddleLevel);
  graph.improve(1000.0, levels);
  EXPECT_EQ(std::ranges::count(levels, kMiddleLevel), std::ptrdiff_t(levels.size()));
}

TEST(LevelGraph, NoSingleChangeToANeighboursLevelReducesTheSum) {
  const Nodes nodes = randomNodes(3);
  const LevelGraph graph(nodes.places, nodes.costs, 1.0);
  for (const double price : {0.5, 2.0, 6.0}) {
    std::vector<std::uint8_t> levels(nodes.places.size(), kMiddleLevel);
    const double first = sumOf(nodes, price, levels);
    graph.improve(price, levels);
    const double sum = sumOf(nodes, price, levels);
    EXPECT_LT(sum, first);
    for (std::size_t a = 0; a < levels.size(); ++a)
      for (std::size_t b = 0; b < levels.size(); ++b) {
        if (!touch(nodes.places[a], nodes.places[b])) continue;
        auto other = levels;
        other[a] = levels[b];
        EXPECT_GE(sumOf(nodes, price, other), sum - 1e-9) << price;
      }
  }
}

}  // namespace
}  // namespace esvr::format

namespace esvr {
namespace {

/// Blobs whose sum is active where it exceeds a threshold that grows along x.
SparseVolume uneven(const Field& field) {
  SparseVolume volume = revoxelise(field, {.threshold = 0.0f});
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    BrickMask active;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const Coord at = volume.brickCorner(b) + voxelLocal(v);
      float& value = volume.brickValues(b)[v];
      if (value > 0.01f * std::exp2(float(at.x) / 12.0f))
        active.set(v);
      else
        value = 0.0f;
    }
    volume.active[b] = active;
  }
  dropInactiveBricks(volume);
  return volume;
}

Field blobs() {
  Field field = test::randomField({.count = 60, .extent = 60.0});
  for (float& i : field.chunks[0].ellipsoids.intensity) i = std::abs(i);
  return field;
}

StoredGrid stored(Activity activity) {
  const Field field = blobs();
  return makeStoredGrid({}, uneven(field), field, {activity});
}

double overlapOf(const StoredGrid& grid) {
  return compareVolumes(uneven(blobs()), decodeGrid(grid)).iou;
}

TEST(ChooseLevels, ThresholdsOfBlocksRestoreWhatOneDoesNot) {
  const StoredGrid one = stored(Activity::kByValue), several = stored(Activity::kAuto);
  EXPECT_EQ(one.topology, TopologyKind::kThreshold);
  EXPECT_LT(overlapOf(one), 0.9);
  ASSERT_EQ(several.topology, TopologyKind::kBlocks);
  EXPECT_GT(overlapOf(several), kMinOverlap);
  EXPECT_EQ(stored(Activity::kNoMask).levels, several.levels);
}

TEST(ChooseLevels, TheyTakeFewerBytesThanAMask) {
  const StoredGrid several = stored(Activity::kAuto), exact = stored(Activity::kExact);
  EXPECT_LT(4 * format::putLevels({several.bricks, several.levels}).size(),
            bytesAdded(exact) - bytesAdded(stored(Activity::kByValue)));
}

TEST(ChooseLevels, AreTheSameForAnyNumberOfThreads) {
  const auto levels = [] { return stored(Activity::kAuto).levels; };
  const auto one = test::onThreads(1, levels);
  EXPECT_EQ(one, test::onThreads(2, levels));
  EXPECT_EQ(one, test::onThreads(5, levels));
}

// Every second voxel is active, whatever its value.
TEST(ChooseLevels, AreNotFoundWhereValuesDoNotTell) {
  const Field field = blobs();
  SparseVolume source = revoxelise(field, {.threshold = 0.05f});
  for (BrickMask& mask : source.active)
    for (auto& word : mask.words) word &= 0x5555555555555555u;
  EXPECT_EQ(makeStoredGrid({}, source, field).topology, TopologyKind::kMask);
  EXPECT_EQ(makeStoredGrid({}, source, field, {Activity::kNoMask}).topology,
            TopologyKind::kThreshold);
}

TEST(ChooseLevels, AreRenewedForEllipsoidsThatHaveChanged) {
  const SparseVolume source = uneven(blobs());
  StoredGrid grid = stored(Activity::kAuto);
  for (float& i : grid.field.chunks[0].ellipsoids.intensity) i *= 3.0f;
  ASSERT_LT(overlapOf(grid), kMinOverlap);
  renewActivity(source, {}, grid);
  EXPECT_EQ(grid.topology, TopologyKind::kBlocks);
  EXPECT_GT(overlapOf(grid), kMinOverlap);
}

TEST(ChooseLevels, APartIsDecodedAsInTheWhole) {
  const StoredGrid grid = stored(Activity::kAuto);
  const Box all = grid.activeBox, box{all.min + Coord{3, 3, 3}, all.max - Coord{9, 5, 3}};
  const SparseVolume whole = decodeGrid(grid), part = decodeGrid(grid, {.box = box});
  for (Coord v = all.min; v.y <= all.max.y; ++v.y)
    for (v.x = all.min.x; v.x <= all.max.x; ++v.x)
      EXPECT_EQ(valueAt(part, v), box.contains(v) ? valueAt(whole, v) : 0.0f);
}

TEST(ChooseLevels, AGivenThresholdReplacesThem) {
  const StoredGrid grid = stored(Activity::kAuto);
  const SparseVolume decoded = decodeGrid(grid, {.threshold = 0.1f});
  const SparseVolume expected = revoxelise(grid.field, {.threshold = 0.1f,
                                                        .range = voxelRule(grid).range,
                                                        .bricks = grid.bricks,
                                                        .restrictToBricks = true,
                                                        .box = grid.activeBox});
  EXPECT_EQ(decoded.active, expected.active);
}

}  // namespace
}  // namespace esvr
