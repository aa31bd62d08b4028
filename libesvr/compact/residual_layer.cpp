#include "compact/residual_layer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "field/evaluate_plan.h"

namespace esvr::compact {
namespace {

/// Largest difference of evaluateBricks between two machines, as a share of the sum of |I|: twice
/// the error that field.h states, for aspect ratios up to 100 and up to 1000.
constexpr double kDifference = 2.0 * 4e-6, kDifferenceStretched = 2.0 * 2e-4;
constexpr double kStretchedLog = 4.6;  // natural logarithm of an aspect ratio of 100
}  // namespace

std::vector<double> marginsOf(const Field& field, std::span<const Coord> corners) {
  std::vector<double> differences;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const auto [low, high] = std::minmax({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]});
      differences.push_back(std::abs(double(e.intensity[i])) *
                            (high - low < kStretchedLog ? kDifference : kDifferenceStretched));
    }
  }
  const BrickPairs pairs = planEvaluation(field, corners).pairs;
  std::vector<double> margins(corners.size(), kDifference * std::abs(double(field.background)));
  for (std::size_t b = 0; b < corners.size(); ++b)
    for (std::uint32_t p = pairs.brickBegin[b]; p < pairs.brickBegin[b + 1]; ++p)
      margins[b] += differences[pairs.ellipsoid[p]];
  return margins;
}

VoxelLayer layerOf(const std::vector<BrickCodes>& bricks, double divisor) {
  VoxelLayer layer;
  layer.form = VoxelForm::kQuantised;
  layer.divisor = divisor;
  if (!bricks.empty()) layer.origin = bricks.front().corner;
  for (const BrickCodes& brick : bricks) layer.origin = minCoord(layer.origin, brick.corner);
  for (const BrickCodes& brick : bricks) {
    layer.bricks.push_back(brickOf(brick.corner - layer.origin));
    layer.codes.insert(layer.codes.end(), brick.codes.begin(), brick.codes.end());
  }
  layer.active.resize(bricks.size());
  layer.vacant.resize(bricks.size());
  for (BrickMask& mask : layer.active) mask.setAll();
  return layer;
}

SparseVolume sumIn(const StoredGrid& grid, std::span<const Coord> corners) {
  return revoxelise(grid.field, {.threshold = -std::numeric_limits<float>::max(),
                                 .range = voxelRule(grid).range,
                                 .bricks = corners,
                                 .restrictToBricks = true});
}

}  // namespace esvr::compact
