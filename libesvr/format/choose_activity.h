#pragma once
/// Chooses the thresholds by which the voxels of a sum of ellipsoids are active: one for the grid, or levels of blocks
/// (esvr/ellipsoids.h).

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"
#include "field/voxel_rule.h"
#include "format/activity_sections.h"

namespace esvr::format {

// ---- One threshold

struct ThresholdChoice {
  float threshold = 0.0f;
  double iou = 0.0;      ///< intersection over union of the active voxels of source and result
  double squares = 0.0;  ///< squared error of the place's voxels if all of them are active
};

/// Where voxels may become active.
struct ThresholdPlace {
  std::vector<Coord> bricks;  ///< index corners, increasing, of the bricks that a reader evaluates
  Box box;                    ///< voxels outside it are inactive
};

/// Chooses the threshold with the best overlap of the active voxels among those that add no more
/// than 0.004 dB to the error. It is precise to 1/128 of its value. The search takes one evaluation
/// of the field and a histogram. If several thresholds are as good, a middle one is taken, so that
/// rounding on another machine changes no voxel.
/// \param rule  rule of the voxels; its threshold is ignored
[[nodiscard]] ThresholdChoice chooseThreshold(const SparseVolume& source, const Field& field,
                                              const VoxelRule& rule, const ThresholdPlace& place);

// ---- Levels of blocks

/// What levels are chosen for.
struct LevelTask {
  const SparseVolume& source;
  const Field& field;
  VoxelRule rule;               ///< rule of the voxels; its threshold is not used
  const ThresholdPlace& place;  ///< its box is the active box of the source
  float base;                   ///< threshold of level 0, above 0
  double error;                 ///< error of the sum at active voxels (root mean square), above 0
};

/// The levels that take the fewest bits among those found whose overlap with the source suffices
/// (MaskOverlap, esvr/quantised.h). A voxel in the wrong state costs the more, the more it
/// adds to the squared error. The result is the same for any number of threads.
/// \return nothing if no levels suffice
[[nodiscard]] std::optional<Levels> chooseLevels(const LevelTask& task);

// ---- The graph of levels

/// The cost of each level in one place.
using LevelCosts = std::array<float, kLevelCount>;

/// Levels of neighbouring blocks or bricks, weighed by what a level costs in its own place and by the
/// number of neighbours with different levels, on which the bits depend.
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
