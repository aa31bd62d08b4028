#include "format/active_threshold.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/parallel.h"
#include "field/active_region.h"
#include "field/brick_batches.h"

namespace esvr::format {
namespace {

// A bin holds the activities with the same exponent and the same first 7 bits of the mantissa, so
// that the resolution relative to the value is the same from 1e-38 to 1e38.
constexpr int kDroppedBits = 16;

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
};

class Histogram {
 public:
  void add(const VoxelRule& rule, float value, float wanted, bool active) {
    const float settled = rule.settled(value);
    const double kept = double(wanted) - settled;
    error_ += kept * kept;
    const float activity = rule.activity(settled);
    if (!(activity > 0.0f)) return;
    Tally& bin = bins_[binOf(activity)];
    ++(active ? bin.active : bin.inactive);
    const double dropped = double(wanted) - rule.inactiveValue(settled);
    bin.cost += dropped * dropped - kept * kept;
  }

  void add(const Histogram& other) {
    error_ += other.error_;
    for (std::size_t k = 0; k < bins_.size(); ++k) {
      bins_[k].active += other.bins_[k].active;
      bins_[k].inactive += other.bins_[k].inactive;
      bins_[k].cost += other.bins_[k].cost;
    }
  }

  [[nodiscard]] ThresholdChoice best(std::uint64_t sourceActive) const {
    Tally kept = total();
    const double allowed = kAllowedShare * error_;
    double cost = 0.0, bestIou = 0.0;
    std::size_t first = 0, last = 0;
    for (std::size_t k = 0; k < bins_.size(); ++k) {
      const double iou = double(kept.active) / double(sourceActive + kept.inactive);
      if (cost <= allowed && iou > bestIou) {
        bestIou = iou;
        first = last = k;
      } else if (cost <= allowed && iou == bestIou && last + 1 == k) {
        last = k;
      }
      kept.active -= bins_[k].active;
      kept.inactive -= bins_[k].inactive;
      cost += bins_[k].cost;
    }
    return {thresholdBelow((first + last) / 2), bestIou, error_};
  }

 private:
  [[nodiscard]] Tally total() const {
    Tally sum;
    for (const Tally& bin : bins_) {
      sum.active += bin.active;
      sum.inactive += bin.inactive;
    }
    return sum;
  }

  double error_ = 0.0;  ///< the squared error if every voxel is active
  std::vector<Tally> bins_ = std::vector<Tally>(kBins);
};

/// Adds the voxels of a brick that lie in a box.
void addBrick(const SparseVolume& source, const VoxelRule& rule, const Box& box, Coord corner,
              std::span<const float> values, Histogram& histogram) {
  const auto b = findBrick(source, brickOf(corner - source.origin));
  const BrickMask inBox = maskOf(box, corner);
  for (int v = 0; v < kBrickVoxels; ++v) {
    if (!inBox.test(v)) continue;
    const float wanted = b ? source.brickValues(*b)[v] : source.background;
    histogram.add(rule, values[v], wanted, b && source.active[*b].test(v));
  }
}

/// Bricks of a batch that are counted by one thread. A histogram takes 0.8 MB.
constexpr std::size_t kBricksOfPart = 1024;

}  // namespace

ThresholdChoice chooseThreshold(const SparseVolume& source, const Field& field,
                                const VoxelRule& rule, const ThresholdPlace& place) {
  // The bricks of a part do not depend on the number of threads, so that sums are the same for any.
  const std::size_t batch = std::min(kBatchBricks, place.bricks.size());
  std::vector<Histogram> parts((batch + kBricksOfPart - 1) / kBricksOfPart);
  forEachBatch(field, place.bricks, [&](const BrickBatch& sums) {
    parallelFor(std::size_t{0}, parts.size(), [&](std::size_t p) {
      const std::size_t end = std::min((p + 1) * kBricksOfPart, sums.size());
      for (std::size_t b = p * kBricksOfPart; b < end; ++b)
        addBrick(source, rule, place.box, sums.corners[b], sums.values(b), parts[p]);
    });
  });
  Histogram whole;
  for (const Histogram& part : parts) whole.add(part);
  return whole.best(activeVoxelCount(source));
}

}  // namespace esvr::format
