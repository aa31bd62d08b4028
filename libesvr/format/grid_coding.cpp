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
#include "format/active_threshold.h"
#include "format/grid_rule.h"
#include "format/residual_value.h"

namespace esvr {
namespace {

using format::ruleOf;
using format::ThresholdChoice;

constexpr float kAlwaysActive = -std::numeric_limits<float>::max();  // below every activity

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

void storeMask(const SparseVolume& source, StoredGrid& grid) {
  grid.topology = TopologyKind::kMask;
  grid.bricks = brickCorners(source);
  grid.mask = source.active;
  grid.activeThreshold = kAlwaysActive;
}

void chooseTopology(const SparseVolume& source, StoredGrid& grid) {
  const auto fitsBest = [&](std::span<const Coord> bricks) {
    return format::chooseThreshold(source, grid.field, ruleOf(grid), bricks);
  };
  if (grid.topology == TopologyKind::kBricks) grid.bricks = brickCorners(source);
  const ThresholdChoice choice = grid.topology == TopologyKind::kBricks
                                     ? fitsBest(grid.bricks)
                                     : fitsBest(reachedBricks(grid.field));
  grid.activeThreshold = choice.threshold;
  if (!(choice.iou > 0.0)) storeMask(source, grid);
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
  options.narrowBand = grid.topology != TopologyKind::kThreshold &&
                       isLevelSet(grid.descriptor, grid.field.background);
  options.bricks = grid.bricks;
  options.restrictToBricks = grid.topology != TopologyKind::kThreshold;
  return options;
}

bool followsFromEllipsoids(const StoredGrid& grid) {
  return !grid.voxels && !grid.residual && grid.topology != TopologyKind::kMask;
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
                          Activity activity) {
  StoredGrid grid = describe(descriptor, source);
  grid.field = std::move(field);
  if (isNarrowBand(descriptor, source)) {
    grid.topology = TopologyKind::kBricks;
    grid.withinRange = false;  // values beyond the band's ends tell its sides apart
  }
  if (activity == Activity::kExact)
    storeMask(source, grid);
  else
    chooseTopology(source, grid);
  return grid;
}

namespace {

bool meets(const Box& box, Coord corner) {
  const Coord last = corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1};
  return corner.x <= box.max.x && corner.y <= box.max.y && corner.z <= box.max.z &&
         last.x >= box.min.x && last.y >= box.min.y && last.z >= box.min.z;
}

/// The bricks on which the field is evaluated; nothing if these are all that supports reach.
std::optional<std::vector<Coord>> bricksWanted(const StoredGrid& grid,
                                               const DecodeOptions& options) {
  const bool stored = grid.topology != TopologyKind::kThreshold;
  if (!stored && !options.box) return std::nullopt;
  if (!stored) return reachedBricks(grid.field, *options.box);
  std::vector<Coord> bricks = grid.bricks;
  if (options.box)
    std::erase_if(bricks, [&](Coord corner) { return !meets(*options.box, corner); });
  return bricks;
}

/// The given bricks and those of the residual, in order.
std::vector<Coord> withResidualBricks(const VoxelLayer& residual, std::span<const Coord> bricks,
                                      const DecodeOptions& options) {
  std::vector<Coord> own, all;
  for (const Coord brick : residual.bricks) {
    const Coord corner = residual.origin + brick * kBrickSide;
    if (!options.box || meets(*options.box, corner)) own.push_back(corner);
  }
  std::set_union(bricks.begin(), bricks.end(), own.begin(), own.end(), std::back_inserter(all));
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
void activate(const VoxelRule& rule, SparseVolume& volume) {
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    volume.active[b] = {};
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (rule.isActive(values[v]))
        volume.active[b].set(v);
      else
        values[v] = rule.inactiveValue(values[v]);
  }
  dropInactiveBricks(volume);
}

SparseVolume evaluatedWithResidual(const StoredGrid& grid, const DecodeOptions& options) {
  auto wanted = bricksWanted(grid, options);
  if (!wanted) wanted = reachedBricks(grid.field);
  const auto bricks = withResidualBricks(*grid.residual, *wanted, options);
  SparseVolume volume = revoxelise(grid.field, {.threshold = kAlwaysActive,
                                                .range = voxelRule(grid).range,
                                                .bricks = bricks,
                                                .restrictToBricks = true,
                                                .memory = options.memory});
  addResidual(*grid.residual, volume);
  VoxelRule rule = ruleOf(grid);
  rule.threshold = options.threshold.value_or(rule.threshold);
  activate(rule, volume);
  return volume;
}

SparseVolume evaluated(const StoredGrid& grid, const DecodeOptions& options) {
  if (grid.residual) return evaluatedWithResidual(grid, options);
  RevoxeliseOptions revoxel = voxelRule(grid);
  revoxel.threshold = options.threshold.value_or(revoxel.threshold);
  const auto bricks = bricksWanted(grid, options);
  if (bricks) revoxel.bricks = *bricks;
  revoxel.restrictToBricks = bricks.has_value();
  revoxel.memory = options.memory;
  return revoxelise(grid.field, revoxel);
}

/// Makes all voxels inactive that are not in the mask.
void applyMask(const StoredGrid& grid, SparseVolume& volume) {
  const VoxelRule rule = ruleOf(grid);
  for (std::size_t b = 0; b < volume.brickCount(); ++b) {
    const auto place =
        std::lower_bound(grid.bricks.begin(), grid.bricks.end(), volume.brickCorner(b));
    const bool stored = place != grid.bricks.end() && *place == volume.brickCorner(b);
    volume.active[b] = stored ? grid.mask[std::size_t(place - grid.bricks.begin())] : BrickMask{};
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v))
        volume.brickValues(b)[v] = rule.inactiveValue(volume.brickValues(b)[v]);
  }
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

}  // namespace

SparseVolume decodeGrid(const StoredGrid& grid, const DecodeOptions& options) {
  if (options.threshold && !(std::isfinite(*options.threshold) && *options.threshold >= 0.0f))
    throw UsageError("the threshold must be 0 or above, not " + std::to_string(*options.threshold));
  if (options.threshold && (grid.voxels || grid.topology == TopologyKind::kMask))
    throw UsageError("grid '" + grid.descriptor.name +
                     "' says itself which voxels are active: it takes no threshold");
  if (options.box && options.box->empty()) throw UsageError("the box of voxels is empty");
  if (options.maxBytes != kNoMemoryLimit)
    requireWithinMemory(estimateDecode(grid, options).bytes(options.memory), options.maxBytes,
                        "grid '" + grid.descriptor.name + "'");
  SparseVolume volume = grid.voxels ? volumeOf(*grid.voxels) : evaluated(grid, options);
  if (!grid.voxels && grid.topology == TopologyKind::kMask) applyMask(grid, volume);
  if (options.box) clip(*options.box, ruleOf(grid), volume);
  return volume;
}

}  // namespace esvr
