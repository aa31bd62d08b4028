// A stored grid of a source: its properties, and the voxels that are active.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/counted.h"
#include "core/parallel.h"
#include "esvr/grid_coding.h"
#include "esvr/volume.h"
#include "field/evaluate.h"
#include "field/voxel_rule.h"
#include "format/grid_rule.h"
#include "format/voxel_sections.h"

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

// ---- What float32 can evaluate

std::string whyImprecise(const StoredGrid& grid) {
  // The error grows with both. It is 2.2e-4 of the largest value where k is 5000, and 1.1e-4 where the sum is 2,487 times
  // smaller than its terms (docs/figures/stability.md).
  constexpr double kSharpest = 2000.0, kMostCancelled = 2000.0;
  double sharpest = grid.field.chunks.empty() ? 0.0 : double(grid.field.kernel.kappa);
  double largest = 0.0;
  for (const Chunk& chunk : grid.field.chunks) {
    for (const float kappa : chunk.ellipsoids.kappa) sharpest = std::max(sharpest, double(kappa));
    for (const float i : chunk.ellipsoids.intensity)
      largest = std::max(largest, std::abs(double(i)));
  }
  if (sharpest > kSharpest)
    return "an edge has a sharpness of " + shortText(sharpest) +
           ", for which float32 has few digits";
  double peak = std::abs(double(grid.field.background));
  for (const float end : {grid.valueMin, grid.valueMax})
    peak = std::max(peak, std::abs(double(grid.tone.isOn() ? grid.tone.of(end) : end)));
  if (peak > 0.0 && largest > kMostCancelled * peak)
    return "its ellipsoids are " + shortText(largest / peak) +
           " times as large as its values and cancel each other, for which float32 has few digits";
  return {};
}

// ---- The threshold of activity

namespace {

// A bin holds the activities with the same exponent and the same first 7 bits of the mantissa, so
// that the resolution relative to the value is the same from 1e-38 to 1e38. An octave is the bins of an exponent.
constexpr int kDroppedBits = 16;
constexpr std::size_t kBinsOfOctave = 128;

/// Squared error that a better overlap may add, as a share of the error that is there if every
/// voxel is active: 0.004 dB.
constexpr double kAllowedShare = 1e-3;

std::size_t binOf(float activity) { return std::bit_cast<std::uint32_t>(activity) >> kDroppedBits; }
const std::size_t kBins = binOf(std::numeric_limits<float>::max()) + 1;

/// The largest threshold at which all voxels of a bin, and of the bins above it, stay active.
float thresholdBelow(std::size_t bin) {
  if (bin == 0) return 0.0f;
  return std::bit_cast<float>((std::uint32_t(bin) << kDroppedBits) - 1);
}

struct Tally {
  std::uint64_t active = 0, inactive = 0;  ///< voxels, by the source's mask
  double cost = 0.0;                       ///< squared error that making these voxels inactive adds

  friend Tally operator+(const Tally& a, const Tally& b) {
    return {a.active + b.active, a.inactive + b.inactive, a.cost + b.cost};
  }
};

struct ThresholdChoice {
  float threshold = 0.0f;
  double iou = 0.0;  ///< intersection over union of the active voxels of source and result
};

/// Octaves without a voxel take no memory, so that every task can have a histogram.
class Histogram {
 public:
  void add(const VoxelRule& rule, float value, float wanted, bool active) {
    const float settled = rule.settled(value);
    const double kept = double(wanted) - settled;
    error_ += kept * kept;
    const float activity = rule.activity(settled);
    if (!(activity > 0.0f)) return;
    const std::size_t k = binOf(activity);
    Tally& bin = octaveOf(k)[k % kBinsOfOctave];
    ++(active ? bin.active : bin.inactive);
    const double dropped = double(wanted) - rule.inactiveValue(settled);
    bin.cost += dropped * dropped - kept * kept;
  }

  void add(const Histogram& other) {
    error_ += other.error_;
    for (std::size_t k = 0; k < kBins; k += kBinsOfOctave) {
      const Octave& octave = other.octaves_[k / kBinsOfOctave];
      if (octave.empty()) continue;
      Octave& own = octaveOf(k);
      std::ranges::transform(own, octave, own.begin(), std::plus<>());
    }
  }

  [[nodiscard]] ThresholdChoice best(std::uint64_t sourceActive) const {
    Tally kept = total();
    const double allowed = kAllowedShare * error_;
    double cost = 0.0, bestIou = 0.0;
    std::size_t first = 0, last = 0;
    for (std::size_t k = 0; k < kBins; ++k) {
      const double iou = double(kept.active) / double(sourceActive + kept.inactive);
      if (cost <= allowed && iou > bestIou) {
        bestIou = iou;
        first = last = k;
      } else if (cost <= allowed && iou == bestIou && last + 1 == k) {
        last = k;
      }
      const Tally dropped = bin(k);
      kept.active -= dropped.active;
      kept.inactive -= dropped.inactive;
      cost += dropped.cost;
    }
    return {thresholdBelow((first + last) / 2), bestIou};
  }

 private:
  using Octave = std::vector<Tally>;

  [[nodiscard]] Octave& octaveOf(std::size_t bin) {
    Octave& octave = octaves_[bin / kBinsOfOctave];
    if (octave.empty()) octave.resize(kBinsOfOctave);
    return octave;
  }

  [[nodiscard]] Tally bin(std::size_t k) const {
    const Octave& octave = octaves_[k / kBinsOfOctave];
    return octave.empty() ? Tally{} : octave[k % kBinsOfOctave];
  }

  [[nodiscard]] Tally total() const {
    Tally sum;
    for (const Octave& octave : octaves_) sum = std::accumulate(octave.begin(), octave.end(), sum);
    return sum;
  }

  double error_ = 0.0;  ///< the squared error if every voxel is active
  std::vector<Octave> octaves_ =
      std::vector<Octave>(kBins / kBinsOfOctave + 1);  ///< empty: no voxel
};

void addBrick(const SparseVolume& source, const VoxelRule& rule, const Box& box, Coord corner,
              std::span<const float> values, Histogram& histogram) {
  const auto b = brickWith(source, corner);
  const BrickMask inBox = maskOf(box, corner);
  for (int v = 0; v < kBrickVoxels; ++v) {
    if (!inBox.test(v)) continue;
    const float wanted = b ? source.brickValues(*b)[v] : source.background;
    histogram.add(rule, values[v], wanted, b && source.active[*b].test(v));
  }
}

/// Bricks of a batch that are counted by one task. A histogram takes 3 KB for each octave of the values.
constexpr std::size_t kBricksOfPart = 64;

/// Chooses the threshold with the best overlap of the active voxels among those that add no more
/// than 0.004 dB to the error. It is precise to 1/128 of its value. The search takes one evaluation
/// of the field and a histogram. If several thresholds are as good, a middle one is taken, so that
/// rounding on another machine changes no voxel.
/// \param bricks  index corners, increasing, of the bricks that a reader evaluates
ThresholdChoice chooseThreshold(const SparseVolume& source, const StoredGrid& grid,
                                const std::vector<Coord>& bricks) {
  const VoxelRule rule = format::ruleOf(grid);  // its threshold is not used
  // The bricks of a part do not depend on the number of threads, so that sums are the same for any.
  const std::size_t batch = std::min(kBatchBricks, bricks.size());
  std::vector<Histogram> parts((batch + kBricksOfPart - 1) / kBricksOfPart);
  forEachBatch(grid.field, bricks, [&](const BrickBatch& sums) {
    parallelFor(std::size_t{0}, parts.size(), [&](std::size_t p) {
      const std::size_t end = std::min((p + 1) * kBricksOfPart, sums.size());
      for (std::size_t b = p * kBricksOfPart; b < end; ++b)
        addBrick(source, rule, grid.activeBox, sums.corners[b], sums.values(b), parts[p]);
    });
  });
  Histogram whole;
  for (const Histogram& part : parts) whole.add(part);
  return whole.best(activeVoxelCount(source));
}

}  // namespace

// ---- The active voxels

namespace {

/// Lets the values decide which voxels are active. \return false if they restore none
bool storeThreshold(const SparseVolume& source, StoredGrid& grid) {
  const bool isBand = grid.topology == TopologyKind::kBricks;
  if (isBand) grid.bricks = brickCorners(source);
  const ThresholdChoice choice = chooseThreshold(
      source, grid, isBand ? grid.bricks : reachedBricks(grid.field, grid.activeBox));
  grid.activeThreshold = choice.threshold;
  grid.boxVoxels = boxVoxels(source, grid.activeBox);
  return choice.iou > 0.0;
}

void storeMask(const SparseVolume& source, StoredGrid& grid) {
  grid.topology = TopologyKind::kMask;
  grid.activeThreshold = format::kAlwaysActive;
  grid.bricks.clear();
  grid.boxVoxels.clear();
  for (std::size_t b = 0; b < source.brickCount(); ++b) {
    if (source.active[b].count() == 0) continue;
    grid.bricks.push_back(source.brickCorner(b));
    grid.mask.push_back(source.active[b]);
  }
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
  format::keepCoded(*grid.voxels);
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
  if (activity == Activity::kExact || !storeThreshold(source, grid)) storeMask(source, grid);
  return grid;
}

}  // namespace esvr
