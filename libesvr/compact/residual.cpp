#include "esvr/residual.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "codec/voxel_values.h"
#include "compact/residual_layer.h"
#include "core/parallel.h"
#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "field/active_region.h"
#include "format/residual_value.h"

namespace esvr {
namespace {

using compact::BrickCodes;

/// Largest margin, as a share of the bound; with more, voxels alone take fewer bytes.
constexpr double kMaxMarginShare = 1.0 / 6.0;

/// Activity threshold as a share of the bound, for grids whose voxels are active by value.
constexpr double kThresholdShare = 0.5;
/// Factor of the quantisation step that leaves room for the rounding to float32.
constexpr double kRoundingFactor = 0.99;

/// The largest quantisation step with which every voxel has a code that keeps the bound. By value,
/// the threshold takes a part of the interval, and the margin counts once more.
double stepOf(bool byValue, double bound, double margin) {
  return kRoundingFactor *
         (byValue ? (2.0 - kThresholdShare) * bound - 3.0 * margin : 2.0 * bound - 2.0 * margin);
}

std::vector<Coord> cornersOf(const SparseVolume& volume) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) corners.push_back(volume.brickCorner(b));
  return corners;
}

/// All bricks that may contain an active voxel of the source or of the sum.
std::vector<Coord> bricksOfEither(const StoredGrid& grid, const SparseVolume& source) {
  if (grid.topology != TopologyKind::kThreshold) return grid.bricks;
  const auto own = cornersOf(source), reached = reachedBricks(grid.field);
  std::vector<Coord> all;
  std::set_union(own.begin(), own.end(), reached.begin(), reached.end(), std::back_inserter(all));
  return all;
}

bool becomesHalfs(const StoredGrid& grid) { return grid.descriptor.valueType == ValueType::kHalf; }

/// The largest error of rounding a decoded value of the grid to a half; 0 if it is not rounded.
double roundingOf(const StoredGrid& grid, double bound) {
  if (!becomesHalfs(grid)) return 0.0;
  constexpr int kMantissa = 10, kLowest = -14;  // of a half: bits, smallest exponent
  const double largest =
      std::max(std::abs(double(grid.valueMin)), std::abs(double(grid.valueMax))) + bound;
  return 0.5 * std::ldexp(1.0, std::max(std::ilogb(largest), kLowest) - kMantissa);
}

/// Chooses the codes of a residual that keeps a bound.
class Bounded {
 public:
  /// \param margin    largest margin of a brick
  /// \param rounding  error of rounding to halfs, below the bound
  Bounded(const StoredGrid& grid, double bound, double margin, double rounding)
      : bound_(bound),
        background_(grid.field.background),
        halfs_(becomesHalfs(grid)),
        byValue_(grid.topology == TopologyKind::kThreshold),
        threshold_(byValue_ ? kThresholdShare * bound : 0.0),
        divisor_(1.0 / stepOf(byValue_, bound - rounding, margin)) {}

  [[nodiscard]] float threshold() const { return float(threshold_); }
  [[nodiscard]] double divisor() const { return divisor_; }

  [[nodiscard]] bool mayBeBackground(float wanted) const {
    return std::abs(double(wanted) - background_) <= bound_;
  }

  /// A code that keeps the bound, 0 if possible; nothing if there is none.
  /// \param sum  value of the voxel without a residual
  [[nodiscard]] std::optional<std::int32_t> codeFor(float wanted, float sum, double margin) const {
    if (keepsBound(wanted, sum, margin)) return 0;
    const auto nearest = std::int32_t(std::lround((double(wanted) - sum) * divisor_));
    for (const std::int32_t code : {nearest, nearest - 1, nearest + 1})
      if (keepsBound(wanted, format::corrected(sum, code, divisor_), margin)) return code;
    return std::nullopt;
  }

 private:
  /// True if a voxel of this decoded value keeps the bound. Near the threshold, it must be kept
  /// both by the value and by the background, since another machine may decode either.
  [[nodiscard]] bool keepsBound(float wanted, float value, double margin) const {
    const double activity = std::abs(double(value) - background_);
    const bool mayStay = !byValue_ || activity > threshold_ - margin;
    const bool mayGo = byValue_ && activity <= threshold_ + margin;
    return (!mayStay || isNear(wanted, value, margin)) && (!mayGo || mayBeBackground(wanted));
  }

  /// True if every value within the margin of this one keeps the bound. Rounding does not change the
  /// order of values, so that the halfs of the two ends enclose all others.
  [[nodiscard]] bool isNear(float wanted, float value, double margin) const {
    if (!halfs_) return std::abs(double(wanted) - value) <= bound_ - margin;
    const auto keeps = [&](double v) {
      return std::abs(double(wanted) - codec::nearestHalf(float(v))) <= bound_;
    };
    return keeps(double(value) - margin) && keeps(double(value) + margin);
  }

  double bound_;
  float background_;
  bool halfs_;  ///< whether decoded values are rounded to halfs
  bool byValue_;
  double threshold_, divisor_;
};

/// Fills the codes of one brick. \return false if a voxel has no code that keeps the bound
/// \param region  the other voxels become the background
bool fillCodes(const Bounded& bounded, std::span<const float> wanted, const BrickMask& region,
               std::span<const float> sum, double margin, BrickCodes& out) {
  for (std::size_t v = 0; v < kBrickVoxels; ++v) {
    if (!region.test(int(v))) {
      if (!bounded.mayBeBackground(wanted[v])) return false;
      continue;
    }
    const auto code = bounded.codeFor(wanted[v], sum[v], margin);
    if (!code) return false;
    out.codes[v] = *code;
  }
  return true;
}

}  // namespace

std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source, double bound) {
  if (grid.topology == TopologyKind::kBricks || grid.topology == TopologyKind::kBlocks)
    return std::nullopt;
  const auto corners = bricksOfEither(grid, source);
  const auto margins = compact::marginsOf(grid.field, corners);
  const double margin = margins.empty() ? 0.0 : *std::max_element(margins.begin(), margins.end());
  const double rounding = roundingOf(grid, bound);
  if (margin > kMaxMarginShare * (bound - rounding)) return std::nullopt;
  const Bounded bounded(grid, bound, margin, rounding);
  const SparseVolume sum = compact::sumIn(grid, corners);
  const RevoxeliseOptions rule = voxelRule(grid);
  const std::vector<float> emptyBrick(kBrickVoxels, source.background);
  std::vector<BrickCodes> bricks;
  for (std::size_t b = 0; b < corners.size(); ++b) {
    throwIfCancelled();
    const auto at = findBrick(source, brickOf(corners[b]) - brickOf(source.origin));
    BrickCodes brick{corners[b], {}};
    const BrickMask region = regionIn(rule, corners[b]).within;
    if (!fillCodes(bounded, at ? source.brickValues(*at) : std::span<const float>(emptyBrick),
                   region, sum.brickValues(b), margins[b], brick))
      return std::nullopt;
    if (std::any_of(brick.codes.begin(), brick.codes.end(), [](auto code) { return code != 0; }))
      bricks.push_back(brick);
  }
  grid.residual = compact::layerOf(bricks, bounded.divisor());
  if (grid.topology == TopologyKind::kThreshold) grid.activeThreshold = bounded.threshold();
  return grid;
}

}  // namespace esvr
