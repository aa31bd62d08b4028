#include "esvr/psnr_between.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/brick_index.h"
#include "core/parallel.h"
#include "esvr/field.h"
#include "esvr/metrics.h"
#include "field/brick_batches.h"
#include "field/dilate_bricks.h"
#include "fit/cpu/interpolated_brick.h"
#include "fit/offset.h"

namespace esvr {
namespace {

constexpr std::uint64_t kPositions = 8;

Field movedBack(Field field, const Offset& offset) {
  for (Chunk& chunk : field.chunks)
    for (std::size_t a = 0; a < offset.size(); ++a)
      for (float& c : chunk.ellipsoids.center[a]) c = float(double(c) - offset[a]);
  return field;
}

/// The bricks of a volume in brick coordinates of the index space.
std::vector<Coord> bricksIn(const SparseVolume& volume) {
  std::vector<Coord> bricks;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    bricks.push_back(brickOf(volume.brickCorner(b)));
  return bricks;
}

/// The range to which a reader clamps sums.
std::optional<ValueRange> rangeOf(const SparseVolume& volume, const BetweenOptions& options) {
  if (!options.narrowBand) return options.range;
  const float halfWidth = std::abs(volume.background);
  return ValueRange{-halfWidth, halfWidth};
}

class BetweenError {
 public:
  BetweenError(const SparseVolume& volume, const BetweenOptions& options)
      : options_(options),
        box_(options.box.value_or(activeBox(volume))),
        range_(rangeOf(volume, options)),
        background_(volume.background),
        index_(bricksIn(volume)),
        relative_(volume.values) {
    for (float& v : relative_) v -= background_;
  }

  [[nodiscard]] const Box& box() const { return box_; }

  /// The sum of squared errors at the voxels of the box, moved by the offset.
  [[nodiscard]] double squaresAt(const Field& field, const Offset& offset) const {
    const Field moved = movedBack(field, offset);
    const auto corners = cornersFor(moved);
    double squares = 0.0;
    std::vector<double> ofBricks(std::min(kBatchBricks, corners.size()));
    forEachBatch(moved, corners, [&](const BrickBatch& batch) {
      parallelFor(std::size_t{0}, batch.size(), [&](std::size_t b) {
        ofBricks[b] = squaresOf(batch.corners[b], batch.values(b), offset);
      });
      for (std::size_t b = 0; b < batch.size(); ++b) squares += ofBricks[b];
    });
    return squares;
  }

 private:
  /// The bricks in which the interpolated volume or the sum may differ from the background.
  [[nodiscard]] std::vector<Coord> cornersFor(const Field& field) const {
    std::vector<Coord> corners =
        options_.narrowBand ? index_.bricks() : dilateBricks(index_.bricks());
    for (Coord& c : corners) c = c * kBrickSide;
    if (!options_.narrowBand) {
      const auto reached = reachedBricks(field, box_);
      corners.insert(corners.end(), reached.begin(), reached.end());
      std::sort(corners.begin(), corners.end());
      corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    }
    return corners;
  }

  [[nodiscard]] double squaresOf(Coord corner, std::span<const float> sums,
                                 const Offset& offset) const {
    float wanted[kBrickVoxels];
    interpolateBrick(around(brickOf(corner), offset), offset,
                     options_.narrowBand ? Missing::kNearest : Missing::kZero, wanted);
    double squares = 0.0;
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (!box_.contains(corner + voxelLocal(v))) continue;
      const double r = double(settled(sums[std::size_t(v)])) - double(background_) - wanted[v];
      squares += r * r;
    }
    return squares;
  }

  [[nodiscard]] float settled(float sum) const {
    return range_ ? std::clamp(sum, range_->min, range_->max) : sum;
  }

  [[nodiscard]] InterpolatedBricks around(Coord brick, const Offset& offset) const {
    const auto axes = offsetAxes(offset);
    InterpolatedBricks bricks;
    for (int n = 0; n < kInterpolatedBricks; ++n) {
      const auto found = index_.find(interpolatedBrick(brick, axes.data(), n));
      bricks[std::size_t(n)] = found == BrickIndex::kNone
                                   ? nullptr
                                   : relative_.data() + std::size_t(found) * kBrickVoxels;
    }
    return bricks;
  }

  const BetweenOptions& options_;
  Box box_;
  std::optional<ValueRange> range_;
  float background_;
  BrickIndex index_;
  VoxelArray<float> relative_;  ///< values of the volume less its background
};

}  // namespace

double psnrBetween(const SparseVolume& volume, const Field& field, const BetweenOptions& options) {
  const double peak = options.peak ? *options.peak : peakOf(volume);
  const BetweenError error(volume, options);
  double squares = 0.0;
  for (std::uint64_t n = 0; n < kPositions; ++n)
    squares += error.squaresAt(field, offsetOf(n, 0.0));
  return psnr(squares / (double(kPositions) * error.box().volume()), peak);
}

}  // namespace esvr
