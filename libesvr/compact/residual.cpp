#include "esvr/residual.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "esvr/field.h"
#include "esvr/grid_coding.h"
#include "field/evaluate_plan.h"
#include "format/residual_value.h"

namespace esvr {
namespace {

// What evaluateBricks may be off by, of the sum of |I| (field.h); two machines twice that.
constexpr double kOff = 2.0 * 4e-6, kOffStretched = 2.0 * 2e-4;
constexpr double kStretched = 4.6;        // logarithm of an aspect of 100
constexpr double kMaxMargin = 1.0 / 6.0;  // of the bound

// By value, a voxel within half the bound of the background becomes it.
constexpr double kThreshold = 0.5;
constexpr double kRoundedOff = 0.99;  // of a step: for what rounding to float32 adds

/// What every voxel has room for: where it may become the background and must not, a part of two
/// bounds is lost to the threshold, and margins at either end.
double stepOf(bool byValue, double bound, double margin) {
  return kRoundedOff *
         (byValue ? (2.0 - kThreshold) * bound - 3.0 * margin : 2.0 * bound - 2.0 * margin);
}

/// How far apart two evaluations of each brick may be.
std::vector<double> marginsOf(const Field& field, std::span<const Coord> corners) {
  std::vector<double> off;
  for (const Chunk& chunk : field.chunks) {
    const Ellipsoids& e = chunk.ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const auto [low, high] = std::minmax({e.logScale[0][i], e.logScale[1][i], e.logScale[2][i]});
      off.push_back(std::abs(double(e.intensity[i])) *
                    (high - low < kStretched ? kOff : kOffStretched));
    }
  }
  const BrickPairs pairs = planEvaluation(field, corners).pairs;
  std::vector<double> margins(corners.size(), kOff * std::abs(double(field.background)));
  for (std::size_t b = 0; b < corners.size(); ++b)
    for (std::uint32_t p = pairs.brickBegin[b]; p < pairs.brickBegin[b + 1]; ++p)
      margins[b] += off[pairs.ellipsoid[p]];
  return margins;
}

std::vector<Coord> cornersOf(const SparseVolume& volume) {
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < volume.brickCount(); ++b) corners.push_back(volume.brickCorner(b));
  return corners;
}

/// All bricks that may hold an active voxel, of the source or of the sum.
std::vector<Coord> bricksOfEither(const StoredGrid& grid, const SparseVolume& source) {
  if (grid.topology != TopologyKind::kThreshold) return grid.leaves;
  const auto own = cornersOf(source), reached = reachedBricks(grid.field);
  std::vector<Coord> all;
  std::set_union(own.begin(), own.end(), reached.begin(), reached.end(), std::back_inserter(all));
  return all;
}

/// Chooses codes.
class Bounded {
 public:
  /// \param margin  the largest of a brick
  Bounded(const StoredGrid& grid, double bound, double margin)
      : bound_(bound),
        background_(grid.field.background),
        byValue_(grid.topology == TopologyKind::kThreshold),
        threshold_(byValue_ ? kThreshold * bound : 0.0),
        divisor_(1.0 / stepOf(byValue_, bound, margin)) {}

  [[nodiscard]] float threshold() const { return float(threshold_); }
  [[nodiscard]] double divisor() const { return divisor_; }

  /// The smallest code that serves; nothing where none does. \param sum  the value without it
  [[nodiscard]] std::optional<std::int32_t> codeFor(float wanted, float sum, double margin) const {
    if (serves(wanted, sum, margin)) return 0;
    const auto near = std::int32_t(std::lround((double(wanted) - sum) * divisor_));
    for (const std::int32_t code : {near, near - 1, near + 1})
      if (serves(wanted, format::corrected(sum, code, divisor_), margin)) return code;
    return std::nullopt;
  }

 private:
  /// A voxel that may come back as `value` or, near the threshold, as the background.
  [[nodiscard]] bool serves(float wanted, float value, double margin) const {
    const double activity = std::abs(double(value) - background_);
    const bool mayStay = !byValue_ || activity > threshold_ - margin;
    const bool mayGo = byValue_ && activity <= threshold_ + margin;
    return (!mayStay || std::abs(double(wanted) - value) <= bound_ - margin) &&
           (!mayGo || std::abs(double(wanted) - background_) <= bound_);
  }

  double bound_;
  float background_;
  bool byValue_;
  double threshold_, divisor_;
};

struct BrickCodes {
  Coord corner;
  std::array<std::int32_t, kBrickVoxels> codes{};
};

/// The codes of one brick. \return false where a voxel has none
bool fillCodes(const Bounded& bounded, std::span<const float> wanted, const BrickMask* mask,
               std::span<const float> sum, double margin, BrickCodes& out) {
  for (std::size_t v = 0; v < kBrickVoxels; ++v) {
    if (mask && !mask->test(int(v))) continue;
    const auto code = bounded.codeFor(wanted[v], sum[v], margin);
    if (!code) return false;
    out.codes[v] = *code;
  }
  return true;
}

VoxelLayer layerOf(const std::vector<BrickCodes>& bricks, double divisor) {
  VoxelLayer layer;
  layer.form = VoxelForm::kLattice;
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

/// The sum in bricks, every voxel active.
SparseVolume sumIn(const StoredGrid& grid, std::span<const Coord> corners) {
  return revoxelise(grid.field, {.threshold = -std::numeric_limits<float>::max(),
                                 .range = voxelRule(grid).range,
                                 .bricks = corners,
                                 .restrictToBricks = true});
}

}  // namespace

std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source, double bound) {
  if (grid.topology == TopologyKind::kLeaves) return std::nullopt;
  const auto corners = bricksOfEither(grid, source);
  const auto margins = marginsOf(grid.field, corners);
  const double margin = margins.empty() ? 0.0 : *std::max_element(margins.begin(), margins.end());
  if (margin > kMaxMargin * bound) return std::nullopt;
  const Bounded bounded(grid, bound, margin);
  const SparseVolume sum = sumIn(grid, corners);
  const std::vector<float> nothing(kBrickVoxels, source.background);
  std::vector<BrickCodes> bricks;
  for (std::size_t b = 0; b < corners.size(); ++b) {
    const auto at = findBrick(source, brickOf(corners[b]) - brickOf(source.origin));
    BrickCodes brick{corners[b], {}};
    const BrickMask* mask = grid.mask.empty() ? nullptr : &grid.mask[b];
    if (!fillCodes(bounded, at ? source.brickValues(*at) : std::span<const float>(nothing), mask,
                   sum.brickValues(b), margins[b], brick))
      return std::nullopt;
    if (std::any_of(brick.codes.begin(), brick.codes.end(), [](auto code) { return code != 0; }))
      bricks.push_back(brick);
  }
  grid.residual = layerOf(bricks, bounded.divisor());
  if (grid.topology == TopologyKind::kThreshold) grid.activeThreshold = bounded.threshold();
  return grid;
}

}  // namespace esvr
