#include "esvr/grid_coding.h"

#include <cmath>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "format/active_threshold.h"
#include "format/grid_rule.h"

namespace esvr {
namespace {

using format::ruleOf;
using format::ThresholdChoice;

constexpr float kAlwaysActive = -1.0f;  // below every activity

bool isLevelSet(const GridDescriptor& descriptor, float background) {
  return descriptor.gridClass == GridClass::kLevelSet && background > 0.0f;
}

/// A distance field may have active voxels beyond its half width, which a narrow band would lose.
bool withinBand(const ValueRange& range, float halfWidth) {
  return range.min >= -halfWidth && range.max <= halfWidth;
}

std::vector<Coord> brickCorners(const SparseVolume& volume) {
  std::vector<Coord> corners(volume.brickCount());
  for (std::size_t b = 0; b < corners.size(); ++b) corners[b] = volume.brickCorner(b);
  return corners;
}

void chooseTopology(const SparseVolume& source, EncodedGrid& grid) {
  const auto fitsBest = [&](std::span<const Coord> bricks) {
    return format::chooseThreshold(source, grid.field, ruleOf(grid), bricks);
  };
  if (grid.topology == TopologyKind::kLeaves) grid.leaves = brickCorners(source);
  const ThresholdChoice choice = grid.topology == TopologyKind::kLeaves
                                     ? fitsBest(grid.leaves)
                                     : fitsBest(reachedBricks(grid.field));
  grid.activeThreshold = choice.threshold;
  if (choice.iou > 0.0) return;
  grid.topology = TopologyKind::kLeaves;
  grid.leaves = brickCorners(source);
  grid.activeThreshold = kAlwaysActive;
}

}  // namespace

namespace format {

ActivityRule ruleOf(const EncodedGrid& grid) {
  const float background = grid.field.background;
  return {background, grid.nonNegative,
          grid.topology == TopologyKind::kLeaves && isLevelSet(grid.descriptor, background)};
}

}  // namespace format

EncodedGrid encodeGrid(const GridDescriptor& descriptor, const SparseVolume& source, Field field) {
  const ValueRange range = activeRange(source);
  EncodedGrid grid;
  grid.descriptor = descriptor;
  grid.field = std::move(field);
  grid.nonNegative = range.min >= 0.0f && source.background >= 0.0f;
  grid.activeBox = activeBox(source);
  grid.activeVoxels = activeVoxelCount(source);
  grid.valueMin = range.min;
  grid.valueMax = range.max;
  if (isLevelSet(descriptor, source.background) && withinBand(range, source.background))
    grid.topology = TopologyKind::kLeaves;
  chooseTopology(source, grid);
  return grid;
}

SparseVolume decodeGrid(const EncodedGrid& grid, const DecodeOptions& options) {
  if (options.threshold && !(std::isfinite(*options.threshold) && *options.threshold >= 0.0f))
    throw UsageError("the threshold must be 0 or above, not " + std::to_string(*options.threshold));
  const ActivityRule rule = ruleOf(grid);
  return revoxelise(grid.field, {.threshold = options.threshold.value_or(grid.activeThreshold),
                                 .nonNegative = rule.nonNegative,
                                 .narrowBand = rule.narrowBand,
                                 .bricks = grid.leaves,
                                 .restrictToBricks = grid.topology == TopologyKind::kLeaves});
}

}  // namespace esvr
