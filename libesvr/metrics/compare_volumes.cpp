#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "esvr/error.h"
#include "esvr/metrics.h"
#include "metrics/brick_pairs.h"
#include "metrics/error_sums.h"
#include "metrics/order_statistic.h"

namespace esvr {
namespace {

using metrics::Backgrounds;
using metrics::BrickPair;
using metrics::ErrorSums;

constexpr std::uint64_t kP999Permille = 999;

double choosePeak(const SparseVolume& reference, const CompareOptions& options) {
  const double peak = options.peak ? *options.peak : peakOf(reference);
  if (!(peak > 0.0) || !std::isfinite(peak))
    throw UsageError("the peak must be positive, not " + std::to_string(peak));
  return peak;
}

Box chooseBox(const SparseVolume& reference, const CompareOptions& options) {
  const Box box = options.box.value_or(activeBox(reference));
  if (box.empty())
    throw UsageError("the box from " + toString(box.min) + " to " + toString(box.max) +
                     " has no voxel");
  return box;
}

/// The next brick of a box in the order of Coord.
Coord nextBrick(Coord brick, const Box& bricks) {
  if (++brick.z <= bricks.max.z) return brick;
  brick.z = bricks.min.z;
  if (++brick.y <= bricks.max.y) return brick;
  brick.y = bricks.min.y;
  ++brick.x;
  return brick;
}

/// The first voxel of the box outside all pairs. The search makes at most one step for each pair,
/// because every step passes a pair.
Coord firstFreeVoxel(std::span<const BrickPair> pairs, const Box& box) {
  const Box bricks{brickOf(box.min), brickOf(box.max)};
  Coord place = bricks.min;
  for (const BrickPair& pair : pairs) {
    if (!bricks.contains(pair.brick)) continue;
    if (pair.brick != place) break;
    place = nextBrick(place, bricks);
  }
  return maxCoord(place * kBrickSide, box.min);
}

/// Adds the voxels of the box that lie in no brick; their error is the backgrounds' difference.
void addEmptySpace(ErrorSums& sums, std::span<const BrickPair> pairs,
                   const metrics::ErrorDomain& domain) {
  const double empty = domain.box.volume() - sums.voxels;
  const double error = std::abs(domain.backgrounds.reference - domain.backgrounds.candidate);
  if (empty < 1.0) return;
  sums.squaredError += empty * error * error;
  if (error <= sums.maxError) return;
  sums.maxError = error;
  sums.maxErrorAt = firstFreeVoxel(pairs, domain.box);
}

void refuseNonFinite(const ErrorSums& sums, const Backgrounds& backgrounds) {
  if (sums.nonFinite)
    throw BadInput("the value at " + toString(*sums.nonFinite) + " is not finite");
  if (!std::isfinite(backgrounds.reference) || !std::isfinite(backgrounds.candidate))
    throw BadInput("the background is not finite");
}

/// Two volumes that are being compared.
struct Comparison {
  double peak = 0.0;
  metrics::ErrorDomain domain;
  std::vector<BrickPair> pairs;
  ErrorSums sums;

  [[nodiscard]] double mseBox() const { return sums.squaredError / domain.box.volume(); }
};

Comparison compared(const SparseVolume& reference, const SparseVolume& candidate,
                    const CompareOptions& options) {
  if (activeVoxelCount(reference) == 0) throw BadInput("the reference has no active voxel");
  Comparison c;
  c.domain = {chooseBox(reference, options), {reference.background, candidate.background}};
  c.pairs = metrics::pairBricks(reference, candidate);
  c.sums = metrics::sumErrors(c.pairs, c.domain);
  refuseNonFinite(c.sums, c.domain.backgrounds);
  c.peak = choosePeak(reference, options);
  addEmptySpace(c.sums, c.pairs, c.domain);
  return c;
}

VolumeMetrics metricsOf(const Comparison& c) {
  const ErrorSums& sums = c.sums;
  VolumeMetrics m;
  m.peak = c.peak;
  m.boxVoxels = c.domain.box.volume();
  m.activeVoxels = sums.activeReference;
  m.mseBox = c.mseBox();
  m.mseActive = sums.squaredErrorActive / double(sums.activeReference);
  m.psnrBox = psnr(m.mseBox, m.peak);
  m.psnrActive = psnr(m.mseActive, m.peak);
  m.maxError = sums.maxError;
  m.maxErrorAt = sums.maxErrorAt;
  m.p999Error =
      metrics::errorOfRank(c.pairs, metrics::nearestRank(sums.activeUnion, kP999Permille));
  m.iou = double(sums.activeIntersection) / double(sums.activeUnion);
  m.massReference = sums.massReference;
  m.massCandidate = sums.massCandidate;
  return m;
}

}  // namespace

double peakOf(const SparseVolume& reference) {
  return peakOf(activeRange(reference), reference.background);
}

double valueRangeOf(const SparseVolume& reference) {
  const ValueRange range = activeRange(reference);
  return double(range.max) - double(range.min);
}

double psnr(double mse, double peak) {
  if (mse == 0.0) return std::numeric_limits<double>::infinity();
  return 20.0 * std::log10(peak) - 10.0 * std::log10(mse);
}

VolumeMetrics compareVolumes(const SparseVolume& reference, const SparseVolume& candidate,
                             const CompareOptions& options) {
  const Comparison c = compared(reference, candidate, options);
  VolumeMetrics m = metricsOf(c);
  if (options.ssim) m.ssim = ssim3d(reference, candidate, c.domain.box, c.peak);
  return m;
}

double psnrOverBox(const SparseVolume& reference, const SparseVolume& candidate,
                   const CompareOptions& options) {
  const Comparison c = compared(reference, candidate, options);
  return psnr(c.mseBox(), c.peak);
}

}  // namespace esvr
