// Plan: without a price, each node has its cheapest level; with a high one, all agree; the sum of costs
// never grows, and at the end no single change reduces it; levels of the previous frame attract.
#include "format/level_graph.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

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
