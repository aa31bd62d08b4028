// A stored grid of a source: its properties, and the voxels that are active.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "esvr/grid_coding.h"
#include "esvr/volume.h"
#include "field/voxel_rule.h"
#include "format/choose_activity.h"
#include "format/grid_rule.h"

namespace esvr {

// ---- Narrow bands

std::string whyNoNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source) {
  if (descriptor.gridClass != GridClass::kLevelSet) return "it is no level set";
  if (!(source.background > 0.0f))
    return "its background, the half width of a band, is not above 0";
  const ValueRange range = activeRange(source);
  // A distance field may have active voxels beyond the band, which a narrow band could not store.
  if (!(range.min >= -source.background && range.max <= source.background))
    return "an active voxel is farther from the surface than its background, the half width";
  if (!(range.min < 0.0f)) return "no active voxel is negative, so that nothing is inside";
  if (!EmptySigns(source).agree()) return "its surface has holes, so that no side of it is inside";
  return {};
}

bool isNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source) {
  return whyNoNarrowBand(descriptor, source).empty();
}

// ---- The active voxels

void storeMask(const SparseVolume& source, std::span<const BrickMask> masks, StoredGrid& grid) {
  grid.topology = TopologyKind::kMask;
  grid.activeThreshold = format::kAlwaysActive;
  grid.bricks.clear();
  grid.levels.clear();
  grid.mask.clear();
  for (std::size_t b = 0; b < masks.size(); ++b) {
    if (masks[b].count() == 0) continue;
    grid.bricks.push_back(source.brickCorner(b));
    grid.mask.push_back(masks[b]);
  }
}

namespace {

using format::ruleOf;
using format::ThresholdChoice;

std::vector<Coord> brickCorners(const SparseVolume& volume) {
  std::vector<Coord> corners(volume.brickCount());
  for (std::size_t b = 0; b < corners.size(); ++b) corners[b] = volume.brickCorner(b);
  return corners;
}

/// Where voxels may become active by their values.
format::ThresholdPlace placeOf(const StoredGrid& grid) {
  return {grid.topology == TopologyKind::kBricks ? grid.bricks
                                                 : reachedBricks(grid.field, grid.activeBox),
          grid.activeBox};
}

ThresholdChoice chooseThreshold(const SparseVolume& source, const StoredGrid& grid) {
  return format::chooseThreshold(source, grid.field, ruleOf(grid), placeOf(grid));
}

/// Root mean square error of the active voxels.
double errorOf(const ThresholdChoice& choice, const StoredGrid& grid) {
  return std::sqrt(choice.squares / double(grid.activeVoxels));
}

/// True if the volume's values are in memory. Coding a mask, and choosing levels, takes as much memory
/// as they do.
bool fitsIntoMemory(const SparseVolume& source) {
  return !memoryOf(source).isInFile(source.values.size() * sizeof(float));
}

/// Gives the blocks of a grid thresholds of their own. \return false if none suffice
bool storeLevels(const SparseVolume& source, const ThresholdChoice& choice, StoredGrid& grid) {
  constexpr double kLeastShare = 1e-3;  // of the threshold, where the sum is nearly exact
  const double sumError = errorOf(choice, grid);
  const float middle = choice.threshold > 0.0f ? choice.threshold : float(sumError);
  const double error = std::max(sumError, kLeastShare * middle);
  const float base = middle / thresholdAt(1.0f, kMiddleLevel);
  if (!std::isnormal(base)) return false;
  const format::ThresholdPlace place = placeOf(grid);
  auto found = format::chooseLevels({source, grid.field, ruleOf(grid), place, base, error});
  if (!found || !format::areNear(found->bricks)) return false;
  grid.topology = TopologyKind::kBlocks;
  grid.activeThreshold = base;
  grid.bricks = std::move(found->bricks);
  grid.levels = std::move(found->levels);
  return true;
}

void storeSimplifiedMask(const SparseVolume& source, double error,
                         const SimplifiedMasks* simplified, StoredGrid& grid) {
  const SimplifiedMasks own(source);
  storeMask(source, (simplified ? *simplified : own).forError(error), grid);
}

void chooseTopology(const SparseVolume& source, const ActivityOptions& options, StoredGrid& grid) {
  const bool isBand = grid.topology == TopologyKind::kBricks;
  if (isBand) grid.bricks = brickCorners(source);
  const ThresholdChoice choice = chooseThreshold(source, grid);
  grid.activeThreshold = choice.threshold;
  const bool needsMore = options.activity != Activity::kByValue && !isBand &&
                         !(choice.iou > kMinOverlap) && fitsIntoMemory(source);
  if (needsMore && storeLevels(source, choice, grid)) return;
  if (needsMore && options.activity == Activity::kAuto)
    storeSimplifiedMask(source, errorOf(choice, grid), options.simplified, grid);
  else if (!(choice.iou > 0.0))
    storeMask(source, source.active, grid);
}

}  // namespace

// ---- Stored grids

namespace {

/// A stored grid with all properties but its values.
StoredGrid describe(const GridDescriptor& descriptor, const SparseVolume& source) {
  const ValueRange range = activeRange(source);
  StoredGrid grid;
  grid.descriptor = descriptor;
  grid.activeBox = activeBox(source);
  grid.activeVoxels = activeVoxelCount(source);
  grid.valueMin = range.min;
  grid.valueMax = range.max;
  return grid;
}

}  // namespace

StoredGrid makeStoredVoxels(const GridDescriptor& descriptor, const SparseVolume& source,
                            VoxelLayer layer) {
  StoredGrid grid = describe(descriptor, source);
  grid.field.background = source.background;
  grid.voxels = std::move(layer);
  return grid;
}

StoredGrid makeStoredGrid(const GridDescriptor& descriptor, const SparseVolume& source, Field field,
                          const ActivityOptions& options) {
  StoredGrid grid = describe(descriptor, source);
  grid.field = std::move(field);
  if (isNarrowBand(descriptor, source)) {
    grid.topology = TopologyKind::kBricks;
    grid.withinRange = false;  // values beyond the band's ends tell its sides apart
  }
  if (options.activity == Activity::kExact)
    storeMask(source, source.active, grid);
  else
    chooseTopology(source, options, grid);
  return grid;
}

StoredGrid withOneThreshold(StoredGrid grid) {
  if (grid.topology != TopologyKind::kBlocks) return grid;
  grid.topology = TopologyKind::kThreshold;
  grid.activeThreshold = thresholdAt(grid.activeThreshold, kMiddleLevel);
  grid.bricks.clear();
  grid.levels.clear();
  return grid;
}

void renewActivity(const SparseVolume& source, const ActivityOptions& options, StoredGrid& grid) {
  const bool byLevels = grid.topology == TopologyKind::kBlocks;
  const bool byThreshold = grid.topology == TopologyKind::kThreshold;
  if (options.activity == Activity::kByValue || !(byLevels || byThreshold)) return;
  StoredGrid renewed = withOneThreshold(grid);
  if (byThreshold && chooseThreshold(source, renewed).iou > kMinOverlap) return;
  chooseTopology(source, options, renewed);
  grid = std::move(renewed);
}

}  // namespace esvr
