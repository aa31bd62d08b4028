#pragma once
/// Levels of neighbouring blocks or bricks, weighed by what a level costs in its own place and by the
/// number of neighbours with different levels, on which the bits depend.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/block_levels.h"
#include "esvr/coord.h"

namespace esvr::format {

/// The cost of each level in one place.
using LevelCosts = std::array<float, kLevelCount>;

class LevelGraph {
 public:
  /// \param places  coordinates of the nodes; those that differ by 1 along one axis are neighbours
  /// \param costs   costs of each node, which must outlive the graph
  /// \param edge    what an edge is worth: 1 between blocks
  LevelGraph(std::span<const Coord> places, std::span<const LevelCosts> costs, double edge);

  /// Changes the level of one node after the other while that reduces the sum of costs. Nodes that are
  /// no neighbours change at the same time.
  /// \param price  cost of an edge of 1 between different levels
  void improve(double price, std::vector<std::uint8_t>& levels) const;

 private:
  static constexpr int kNeighbours = 6;

  [[nodiscard]] bool isDue(std::size_t node, int round, const std::vector<int>& changes) const;
  [[nodiscard]] std::uint8_t best(std::size_t node, double price,
                                  const std::vector<std::uint8_t>& levels) const;
  [[nodiscard]] double costOf(std::size_t node, std::uint8_t level, double price,
                              const std::vector<std::uint8_t>& levels) const;

  std::span<const LevelCosts> costs_;
  double edge_;
  std::vector<std::array<std::uint32_t, kNeighbours>> near_;
  std::array<std::vector<std::size_t>, 2> byColor_;  ///< neighbours have different colors
  std::vector<std::array<std::uint8_t, 2>> ends_;    ///< first and last of the cheapest levels
};

}  // namespace esvr::format
