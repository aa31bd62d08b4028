// The voxels of a stored grid: the rule by which they follow from the sum of ellipsoids, how much work that is, and the
// decoding of grids of numbers and of vectors.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "codec/voxel_coder.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "field/voxel_rule.h"
#include "format/grid_rule.h"
#include "format/non_finite_section.h"

namespace esvr {

// ---- The rule

RevoxeliseOptions voxelRule(const StoredGrid& grid) {
  RevoxeliseOptions options{.tone = grid.tone, .threshold = grid.activeThreshold};
  const float background = grid.field.background;
  if (grid.withinRange)  // the range of all values of the source, of active and inactive voxels
    options.range =
        ValueRange{std::min(grid.valueMin, background), std::max(grid.valueMax, background)};
  options.narrowBand =
      (grid.topology == TopologyKind::kBricks || grid.topology == TopologyKind::kMask) &&
      grid.descriptor.gridClass == GridClass::kLevelSet && background > 0.0f;
  options.bricks = grid.bricks;
  options.restrictToBricks = grid.topology != TopologyKind::kThreshold;
  options.masks = grid.mask;
  options.box = grid.activeBox;
  options.alwaysActive = grid.boxVoxels;
  return options;
}

bool followsFromEllipsoids(const StoredGrid& grid) {
  return !grid.voxels && !grid.residual && !grid.farBackground && grid.nonFinite.total() == 0;
}

VoxelRule format::ruleOf(const StoredGrid& grid) {
  return makeVoxelRule(grid.field.background, voxelRule(grid));
}

// ---- The work

namespace {

Box boxAround(const std::vector<Coord>& corners) {
  Box box;
  for (const Coord corner : corners)
    box.expand(Box{corner, corner + Coord{kBrickSide - 1, kBrickSide - 1, kBrickSide - 1}});
  return box;
}

EstimateOptions optionsFor(const StoredGrid& grid, const DecodeOptions& options) {
  EstimateOptions estimate{.within = common(grid.activeBox, options.box.value_or(Box::whole())),
                           .enough = double(options.maxBytes),
                           .memory = options.memory};
  if (grid.topology == TopologyKind::kThreshold) return estimate;
  estimate.within = common(estimate.within, boxAround(grid.bricks));
  estimate.maxBricks = double(grid.bricks.size());
  return estimate;
}

}  // namespace

WorkEstimate estimateDecode(const StoredGrid& grid, const DecodeOptions& options) {
  const double nonFinite = grid.nonFiniteVoxels ? double(grid.nonFiniteVoxels->bricks.size()) : 0.0;
  if (grid.voxels) return {.bricks = double(grid.voxels->bricks.size()) + nonFinite};
  WorkEstimate work = estimateWork(grid.field, optionsFor(grid, options));
  if (grid.topology != TopologyKind::kThreshold)
    work.bricks = double(grid.bricks.size());
  else
    work.bricks += double(grid.boxVoxels.size());
  if (grid.residual) work.bricks += double(grid.residual->bricks.size());
  work.bricks += nonFinite;
  return work;
}

// ---- The voxels

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

/// Some bricks of a grid by their increasing corners; nothing: all of them.
using ChosenBricks = std::optional<std::span<const Coord>>;

/// The grid's rule within the wanted box and bricks, and the lists that it refers to.
struct WantedVoxels {
  RevoxeliseOptions rule;
  std::vector<Coord> bricks{};
  std::vector<BrickMask> masks{};

  WantedVoxels(const StoredGrid& grid, const DecodeOptions& options, const ChosenBricks& chosen)
      : rule(voxelRule(grid)) {
    rule.threshold = options.threshold.value_or(rule.threshold);
    if (options.threshold) rule.masks = {}, rule.alwaysActive = {};
    rule.box = placeOf(grid, options);
    rule.memory = options.memory;
    if (rule.restrictToBricks && (options.box || chosen)) {
      takeThose(chosen);
    } else if (chosen) {
      rule.restrictToBricks = true;
      rule.bricks = *chosen;
    }
  }
  WantedVoxels(const WantedVoxels&) = delete;
  WantedVoxels& operator=(const WantedVoxels&) = delete;

 private:
  /// Leaves out the bricks outside the box and those that are not chosen.
  void takeThose(const ChosenBricks& chosen) {
    for (std::size_t b = 0; b < rule.bricks.size(); ++b) {
      if (!meets(rule.box, rule.bricks[b])) continue;
      if (chosen && !std::ranges::binary_search(*chosen, rule.bricks[b])) continue;
      bricks.push_back(rule.bricks[b]);
      if (!rule.masks.empty()) masks.push_back(rule.masks[b]);
    }
    rule.bricks = bricks;
    rule.masks = masks;
  }
};

/// The bricks of the grid that may have an active voxel, with those of the residual, in order.
std::vector<Coord> withResidualBricks(const StoredGrid& grid, const RevoxeliseOptions& rule) {
  const VoxelLayer& residual = *grid.residual;
  if (rule.restrictToBricks) return {rule.bricks.begin(), rule.bricks.end()};
  std::vector<Coord> own, all;
  for (const Coord brick : residual.bricks) {
    const Coord corner = residual.origin + brick * kBrickSide;
    if (meets(rule.box, corner)) own.push_back(corner);
  }
  const auto bricks = voxelBricks(grid.field, rule);
  std::ranges::set_union(bricks, own, std::back_inserter(all));
  return all;
}

/// Adds a residual to the values of the sum, which are clamped to the range of the grid if the grid says so.
void addResidual(const VoxelLayer& residual, SparseVolume& volume) {
  for (std::size_t r = 0; r < residual.bricks.size(); ++r) {
    const Coord corner = residual.origin + residual.bricks[r] * kBrickSide;
    const auto b = brickWith(volume, corner);
    if (!b) continue;
    for (std::size_t v = 0; v < kBrickVoxels; ++v) {
      float& value = volume.brickValues(*b)[v];
      const std::int32_t code = residual.codes[r * kBrickVoxels + v];
      if (code != 0) value = float(double(value) + double(code) / residual.divisor);
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
  SparseVolume volume = revoxelise(grid.field, {.threshold = format::kAlwaysActive,
                                                .range = options.range,
                                                .bricks = bricks,
                                                .restrictToBricks = true,
                                                .memory = options.memory});
  addResidual(*grid.residual, volume);
  activate(makeVoxelRule(grid.field.background, options), options, volume);
  return volume;
}

SparseVolume evaluated(const StoredGrid& grid, const DecodeOptions& options,
                       const ChosenBricks& chosen) {
  const WantedVoxels wanted(grid, options, chosen);
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

/// A costly function of floats for values that repeat, such as those of neighbouring voxels on a lattice.
template <class Function>
class Remembered {
 public:
  using Value = std::invoke_result_t<Function&, float>;

  explicit Remembered(Function function) : function_(std::move(function)) {
    results_.fill({0, function_(0.0f)});
  }

  Value operator()(float argument) {
    constexpr std::uint32_t kGolden =
        0x9e3779b1;  // 2^32 over the golden ratio spreads the arguments
    const auto bits = std::bit_cast<std::uint32_t>(argument);
    Result& result = results_[(bits * kGolden) >> (32 - kBits)];
    if (result.of != bits) result = {bits, function_(argument)};
    return result.value;
  }

 private:
  static constexpr int kBits = 7;  // the table takes one or two kilobytes
  struct Result {
    std::uint32_t of;  ///< bits of the argument
    Value value;
  };
  Function function_;
  std::array<Result, std::size_t{1} << kBits> results_;
};

/// Turns the tones of voxels into values, within the range of the grid.
void applyTone(const VoxelRule& rule, SparseVolume& volume) {
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    Remembered settled([&](float tone) { return rule.settled(tone); });
    for (float& value : volume.brickValues(b)) value = settled(value);
  });
}

/// True if the values of a grid are the source's own.
bool isExact(const StoredGrid& grid) {
  return grid.voxels && grid.voxels->form != VoxelForm::kQuantised;
}

/// Gives the inactive voxels of a level set the background with their sign, as readers of VDB files do. Quantised
/// voxels have them on their lattice, near it.
void settleInactive(float background, SparseVolume& volume) {
  parallelFor(std::size_t{0}, volume.brickCount(), [&](std::size_t b) {
    const auto values = volume.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v)
      if (!volume.active[b].test(v)) values[v] = std::copysign(background, values[v]);
  });
}

/// The layer's voxels in bricks with these corners, increasing.
VoxelLayer partAt(const VoxelLayer& layer, std::span<const Coord> corners) {
  std::vector<std::size_t> chosen;
  for (std::size_t b = 0; b < layer.bricks.size(); ++b)
    if (std::ranges::binary_search(corners, layer.origin + layer.bricks[b] * kBrickSide))
      chosen.push_back(b);
  return codec::partOf(layer, chosen);
}

void requirePossible(const StoredGrid& grid, const DecodeOptions& options) {
  if (options.threshold && !(std::isfinite(*options.threshold) && *options.threshold >= 0.0f))
    throw UsageError("the threshold must be 0 or above, not " + std::to_string(*options.threshold));
  if (options.threshold && (grid.voxels || grid.farBackground))
    throw UsageError("grid '" + shownName(grid.descriptor.name) +
                     "' says itself which voxels are active: it takes no threshold");
  if (options.box && options.box->empty()) throw UsageError("the box of voxels is empty");
}

SparseVolume decodedPart(const StoredGrid& grid, const DecodeOptions& options,
                         const ChosenBricks& chosen) {
  SparseVolume volume = !grid.voxels ? evaluated(grid, options, chosen)
                        : chosen     ? volumeOf(partAt(*grid.voxels, *chosen))
                                     : volumeOf(*grid.voxels);
  if (grid.voxels && grid.tone.isOn() && !isExact(grid)) applyTone(format::ruleOf(grid), volume);
  if (grid.voxels && options.box) clip(*options.box, format::ruleOf(grid), volume);
  if (grid.voxels && !isExact(grid) && grid.descriptor.gridClass == GridClass::kLevelSet &&
      !grid.farBackground)
    settleInactive(volume.background, volume);
  if (grid.farBackground) setBackground(float(grid.descriptor.background), volume);
  if (grid.descriptor.valueType == ValueType::kHalf && !isExact(grid)) roundToHalfs(volume);
  format::restoreNonFinite(
      grid, {placeOf(grid, options), chosen},
      options.keepsNonFinite ? format::NonFiniteAs::kStored : format::NonFiniteAs::kEmpty, volume);
  return volume;
}

}  // namespace

SparseVolume decodeGrid(const StoredGrid& grid, const DecodeOptions& options) {
  requirePossible(grid, options);
  if (options.maxBytes != kNoMemoryLimit)
    requireWithinMemory(estimateDecode(grid, options).bytes(options.memory), options.maxBytes,
                        "grid '" + shownName(grid.descriptor.name) + "'");
  return decodedPart(grid, options, {});
}

// ---- Some bricks

namespace {

void addCorners(const VoxelLayer& layer, std::vector<Coord>& corners) {
  for (const Coord brick : layer.bricks) corners.push_back(layer.origin + brick * kBrickSide);
}

}  // namespace

std::vector<Coord> format::decodedBricks(const StoredGrid& grid, const DecodeOptions& options) {
  requirePossible(grid, options);
  const WantedVoxels wanted(grid, options, {});
  std::vector<Coord> corners;
  if (grid.voxels)
    addCorners(*grid.voxels, corners);
  else if (grid.residual)
    corners = withResidualBricks(grid, wanted.rule);
  else
    corners = voxelBricks(grid.field, wanted.rule);
  if (grid.nonFiniteVoxels && options.keepsNonFinite) addCorners(*grid.nonFiniteVoxels, corners);
  std::erase_if(corners, [&](Coord corner) { return !meets(wanted.rule.box, corner); });
  std::ranges::sort(corners);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

SparseVolume format::decodeBricks(const StoredGrid& grid, const DecodeOptions& options,
                                  std::span<const Coord> bricks) {
  requirePossible(grid, options);
  return decodedPart(grid, options, bricks);
}

// ---- Vectors

VectorGrid decodeVector(const std::string& name, StoredComponents components,
                        const DecodeOptions& options) {
  return format::vectorsOf(name, components, options,
                           [](const StoredGrid& component, const DecodeOptions& left) {
                             return VolumeGrid{.descriptor = component.descriptor,
                                               .volume = decodeGrid(component, left)};
                           });
}

}  // namespace esvr
