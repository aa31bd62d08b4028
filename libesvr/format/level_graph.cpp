#include "format/level_graph.h"

#include <algorithm>
#include <atomic>

#include "core/brick_index.h"
#include "core/parallel.h"

namespace esvr::format {
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

}  // namespace esvr::format
