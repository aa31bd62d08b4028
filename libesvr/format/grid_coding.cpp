#include "esvr/grid_coding.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "esvr/empty_signs.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid_names.h"
#include "field/active_region.h"
#include "format/active_threshold.h"
#include "format/choose_levels.h"
#include "format/grid_rule.h"
#include "format/residual_value.h"

namespace esvr {
namespace {

constexpr float kAlwaysActive = -std::numeric_limits<float>::max();  // below every activity

}  // namespace

void storeMask(const SparseVolume& source, std::span<const BrickMask> masks, StoredGrid& grid) {
  grid.topology = TopologyKind::kMask;
  grid.activeThreshold = kAlwaysActive;
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

bool isLevelSet(const GridDescriptor& descriptor, float background) {
  return descriptor.gridClass == GridClass::kLevelSet && background > 0.0f;
}

/// True if all values are within the half width of the band. A distance field may have active
/// voxels beyond it, which a narrow band could not store.
bool withinBand(const ValueRange& range, float halfWidth) {
  return range.min >= -halfWidth && range.max <= halfWidth;
}

std::vector<Coord> brickCorners(const SparseVolume& volume) {
  std::vector<Coord> corners(volume.brickCount());
  for (std::size_t b = 0; b < corners.size(); ++b) corners[b] = volume.brickCorner(b);
  return corners;
}

/// The range of all values of the source, of active and inactive voxels.
ValueRange rangeOf(const StoredGrid& grid) {
  const float background = grid.field.background;
  return {std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
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

namespace format {

VoxelRule ruleOf(const StoredGrid& grid) {
  return makeVoxelRule(grid.field.background, voxelRule(grid));
}

}  // namespace format

RevoxeliseOptions voxelRule(const StoredGrid& grid) {
  RevoxeliseOptions options{.threshold = grid.activeThreshold};
  if (grid.withinRange) options.range = rangeOf(grid);
  options.narrowBand =
      (grid.topology == TopologyKind::kBricks || grid.topology == TopologyKind::kMask) &&
      isLevelSet(grid.descriptor, grid.field.background);
  options.bricks = grid.bricks;
  options.restrictToBricks = grid.topology != TopologyKind::kThreshold;
  options.masks = grid.mask;
  options.levels = grid.levels;
  options.box = grid.activeBox;
  return options;
}

bool followsFromEllipsoids(const StoredGrid& grid) {
  return !grid.voxels && !grid.residual && !grid.farBackground;
}

std::string whyNoNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source) {
  if (descriptor.gridClass != GridClass::kLevelSet) return "it is no level set";
  if (!(source.background > 0.0f))
    return "its background, the half width of a band, is not above 0";
  const ValueRange range = activeRange(source);
  if (!withinBand(range, source.background))
    return "an active voxel is farther from the surface than its background, the half width";
  if (!(range.min < 0.0f)) return "no active voxel is negative, so that nothing is inside";
  if (!EmptySigns(source).agree()) return "its surface has holes, so that no side of it is inside";
  return {};
}

bool isNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source) {
  return whyNoNarrowBand(descriptor, source).empty();
}

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

namespace {

bool meets(const Box& box, Coord corner) {
  const Coord last = corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1};
  return corner.x <= box.max.x && corner.y <= box.max.y && corner.z <= box.max.z &&
         last.x >= box.min.x && last.y >= box.min.y && last.z >= box.min.z;
}

/// The place of a decoding: that of the grid's active voxels, or a part of it.
Box placeOf(const StoredGrid& grid, const DecodeOptions& options) {
  return options.box ? common(grid.activeBox, *options.box) : grid.activeBox;
}

/// The grid's rule within the wanted box, and the lists that it refers to.
struct WantedVoxels {
  RevoxeliseOptions rule;
  std::vector<Coord> bricks{};
  std::vector<BrickMask> masks{};
  std::vector<BlockLevels> levels{};

  WantedVoxels(const StoredGrid& grid, const DecodeOptions& options) : rule(voxelRule(grid)) {
    rule.threshold = options.threshold.value_or(rule.threshold);
    if (options.threshold) rule.masks = {}, rule.levels = {};
    rule.box = placeOf(grid, options);
    rule.memory = options.memory;
    if (rule.restrictToBricks && options.box) takeThose();
  }
  WantedVoxels(const WantedVoxels&) = delete;
  WantedVoxels& operator=(const WantedVoxels&) = delete;

 private:
  /// Leaves out the bricks outside the box.
  void takeThose() {
    for (std::size_t b = 0; b < rule.bricks.size(); ++b) {
      if (!meets(rule.box, rule.bricks[b])) continue;
      bricks.push_back(rule.bricks[b]);
      if (!rule.masks.empty()) masks.push_back(rule.masks[b]);
      if (!rule.levels.empty()) levels.push_back(rule.levels[b]);
    }
    rule.bricks = bricks;
    rule.masks = masks;
    rule.levels = levels;
  }
};

/// The bricks of the sum that may have an active voxel, and those of the residual, in order.
std::vector<Coord> withResidualBricks(const StoredGrid& grid, const RevoxeliseOptions& rule) {
  const VoxelLayer& residual = *grid.residual;
  if (rule.restrictToBricks) return {rule.bricks.begin(), rule.bricks.end()};
  std::vector<Coord> own, all;
  for (const Coord brick : residual.bricks) {
    const Coord corner = residual.origin + brick * kBrickSide;
    if (meets(rule.box, corner)) own.push_back(corner);
  }
  const auto reached = reachedBricks(grid.field, rule.box);
  std::set_union(reached.begin(), reached.end(), own.begin(), own.end(), std::back_inserter(all));
  return all;
}

void addResidual(const VoxelLayer& residual, SparseVolume& volume) {
  for (std::size_t r = 0; r < residual.bricks.size(); ++r) {
    const Coord corner = residual.origin + residual.bricks[r] * kBrickSide;
    const auto b = findBrick(volume, brickOf(corner) - brickOf(volume.origin));
    if (!b) continue;
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      float& value = volume.brickValues(*b)[v];
      value = format::corrected(value, residual.codes[r * kBrickVoxels + v], residual.divisor);
    }
  }
}

/// Determines the active voxels of values that are not clamped again, by the rule of revoxelise().
void activate(VoxelRule rule, const RevoxeliseOptions& options, SparseVolume& volume) {
  rule.low = -std::numeric_limits<float>::infinity();
  rule.high = std::numeric_limits<float>::infinity();
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    volume.active[b] =
        settle(rule, regionIn(options, volume.brickCorner(b)), volume.brickValues(b));
  dropInactiveBricks(volume);
}

SparseVolume evaluatedWithResidual(const StoredGrid& grid, const RevoxeliseOptions& options) {
  const auto bricks = withResidualBricks(grid, options);
  SparseVolume volume = revoxelise(grid.field, {.threshold = kAlwaysActive,
                                                .range = options.range,
                                                .bricks = bricks,
                                                .restrictToBricks = true,
                                                .memory = options.memory});
  addResidual(*grid.residual, volume);
  activate(makeVoxelRule(grid.field.background, options), options, volume);
  return volume;
}

SparseVolume evaluated(const StoredGrid& grid, const DecodeOptions& options) {
  const WantedVoxels wanted(grid, options);
  return grid.residual ? evaluatedWithResidual(grid, wanted.rule)
                       : revoxelise(grid.field, wanted.rule);
}

/// Makes voxels outside a box inactive and drops bricks without an active voxel.
void clip(const Box& box, const VoxelRule& rule, SparseVolume& volume) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const auto values = volume.brickValues(b);
    BrickMask active;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const bool inside = box.contains(volume.brickCorner(b) + voxelLocal(v));
      if (!inside) values[v] = rule.inactiveValue(values[v]);
      if (inside && volume.active[b].test(v)) active.set(v);
    }
    volume.active[b] = active;
  }
  dropInactiveBricks(volume);
}

/// True if the decoded values are halfs, as those of the source. Exact voxels are the source's own.
bool isRoundedToHalfs(const StoredGrid& grid) {
  return grid.descriptor.valueType == ValueType::kHalf &&
         (!grid.voxels || grid.voxels->form == VoxelForm::kQuantised);
}

}  // namespace

SparseVolume decodeGrid(const StoredGrid& grid, const DecodeOptions& options) {
  if (options.threshold && !(std::isfinite(*options.threshold) && *options.threshold >= 0.0f))
    throw UsageError("the threshold must be 0 or above, not " + std::to_string(*options.threshold));
  if (options.threshold && (grid.voxels || grid.farBackground))
    throw UsageError("grid '" + shownName(grid.descriptor.name) +
                     "' says itself which voxels are active: it takes no threshold");
  if (options.box && options.box->empty()) throw UsageError("the box of voxels is empty");
  if (options.maxBytes != kNoMemoryLimit)
    requireWithinMemory(estimateDecode(grid, options).bytes(options.memory), options.maxBytes,
                        "grid '" + shownName(grid.descriptor.name) + "'");
  SparseVolume volume = grid.voxels ? volumeOf(*grid.voxels) : evaluated(grid, options);
  if (grid.voxels && options.box) clip(*options.box, ruleOf(grid), volume);
  if (grid.farBackground) setBackground(float(grid.descriptor.background), volume);
  if (isRoundedToHalfs(grid)) roundToHalfs(volume);
  return volume;
}

}  // namespace esvr
