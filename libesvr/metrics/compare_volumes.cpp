/// Errors of volumes against a reference. First come the sums over pairs of bricks, from which the
/// metrics of two volumes are computed, then the metrics of vectors, of the change between two frames
/// and of the signs of level sets.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "esvr/error.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"
#include "metrics/brick_pairs.h"

namespace esvr {
namespace {

using metrics::Backgrounds;
using metrics::BrickPair;

/// The box of the sums and the values outside bricks.
struct ErrorDomain {
  Box box;
  Backgrounds backgrounds;
};

struct ErrorSums {
  // sums over the voxels of the bricks that lie in the box
  double voxels = 0.0;
  double squaredError = 0.0;
  double massReference = 0.0, massCandidate = 0.0;
  double maxError = -1.0;  ///< -1 before the first voxel
  Coord maxErrorAt;

  // sums over all bricks
  double squaredErrorActive = 0.0;  ///< over the active voxels of the reference
  std::uint64_t activeReference = 0, activeUnion = 0, activeIntersection = 0;
  std::uint64_t leftOut = 0;  ///< voxels of the bricks in the box that are equal and not finite
  std::uint64_t leftOutActive = 0;  ///< the same over all bricks
  std::optional<Coord> nonFinite;   ///< the first voxel whose error is not a number or infinite

  void keepLargest(double error, Coord at) {
    if (error <= maxError) return;
    maxError = error;
    maxErrorAt = at;
  }
};

/// True if both volumes have an active voxel with the same value that is not finite.
bool areEqualNonFinite(const BrickPair& pair, int v) {
  const double a = pair.referenceAt(v), b = pair.candidateAt(v);
  const bool areSame = (std::isnan(a) && std::isnan(b)) || (std::isinf(a) && a == b);
  return areSame && pair.isReferenceActive(v) && pair.candidateActive &&
         pair.candidateActive->test(v);
}

/// Adds the sums over the voxels of a brick, of which all lie in the box and both volumes have values, in the lanes of
/// SIMD vectors.
/// \return false if an error is not finite; nothing is added then
bool addWholeBrick(const BrickPair& pair, const Backgrounds& backgrounds, ErrorSums& sums) {
  constexpr int kLanes = 4;
  double squares[kLanes] = {}, active[kLanes] = {}, largest[kLanes] = {};
  double reference[kLanes] = {}, candidate[kLanes] = {};
  for (int word = 0; word < kBrickSide; ++word) {
    const std::uint64_t mask = pair.referenceActive->words[word];
    for (int bit = 0; bit < 64; bit += kLanes)
      for (int k = 0; k < kLanes; ++k) {
        const double a = pair.reference[64 * word + bit + k],
                     b = pair.candidate[64 * word + bit + k];
        const double error = a - b, square = error * error;
        squares[k] += square;
        active[k] += double((mask >> (bit + k)) & 1) * square;
        largest[k] = std::max(largest[k], std::abs(error));
        reference[k] += a;
        candidate[k] += b;
      }
  }
  const auto total = [](const double(&lanes)[kLanes]) {
    return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
  };
  if (!std::isfinite(total(squares))) return false;
  sums.voxels += kBrickVoxels;
  sums.squaredError += total(squares);
  sums.squaredErrorActive += total(active);
  sums.massReference += total(reference) - kBrickVoxels * backgrounds.reference;
  sums.massCandidate += total(candidate) - kBrickVoxels * backgrounds.candidate;
  const double error = *std::ranges::max_element(largest);
  if (error <= sums.maxError) return true;
  for (int v = 0; v < kBrickVoxels; ++v)
    sums.keepLargest(std::abs(pair.errorAt(v)), pair.voxelAt(v));
  return true;
}

/// Adds the sums over the voxels of a brick.
void addVoxels(const BrickPair& pair, const ErrorDomain& domain, ErrorSums& sums) {
  const Box local = metrics::localBox(pair.brick, domain.box);
  const bool isWhole = local.volume() == kBrickVoxels && pair.reference && pair.candidate;
  if (isWhole && addWholeBrick(pair, domain.backgrounds, sums)) return;
  sums.voxels += local.volume();
  for (int x = local.min.x; x <= local.max.x; ++x)
    for (int y = local.min.y; y <= local.max.y; ++y)
      for (int z = local.min.z; z <= local.max.z; ++z) {
        const int v = voxelOffset({x, y, z});
        const double error = pair.errorAt(v);
        if (!std::isfinite(error)) {
          sums.leftOut += areEqualNonFinite(pair, v);
          continue;
        }
        sums.squaredError += error * error;
        sums.massReference += pair.referenceAt(v) - domain.backgrounds.reference;
        sums.massCandidate += pair.candidateAt(v) - domain.backgrounds.candidate;
        sums.keepLargest(std::abs(error), pair.voxelAt(v));
      }
  for (int v = 0; v < kBrickVoxels; ++v) {
    const double error = pair.errorAt(v);
    if (std::isfinite(error)) {
      if (pair.isReferenceActive(v)) sums.squaredErrorActive += error * error;
    } else if (areEqualNonFinite(pair, v)) {
      ++sums.leftOutActive;
    } else if (!sums.nonFinite) {
      sums.nonFinite = pair.voxelAt(v);
    }
  }
}

void addPair(const BrickPair& pair, const ErrorDomain& domain, ErrorSums& sums) {
  addVoxels(pair, domain, sums);
  static constexpr BrickMask kNone{};
  const BrickMask& a = pair.referenceActive ? *pair.referenceActive : kNone;
  const BrickMask& b = pair.candidateActive ? *pair.candidateActive : kNone;
  sums.activeReference += std::uint64_t(a.count());
  for (int word = 0; word < kBrickSide; ++word) {
    sums.activeUnion += std::uint64_t(std::popcount(a.words[word] | b.words[word]));
    sums.activeIntersection += std::uint64_t(std::popcount(a.words[word] & b.words[word]));
  }
}

/// Merges sums. `b` belongs to later bricks; of equal largest errors, the first voxel is kept.
ErrorSums joined(ErrorSums a, const ErrorSums& b) {
  a.voxels += b.voxels;
  a.squaredError += b.squaredError;
  a.massReference += b.massReference;
  a.massCandidate += b.massCandidate;
  a.keepLargest(b.maxError, b.maxErrorAt);
  a.squaredErrorActive += b.squaredErrorActive;
  a.activeReference += b.activeReference;
  a.activeUnion += b.activeUnion;
  a.activeIntersection += b.activeIntersection;
  a.leftOut += b.leftOut;
  a.leftOutActive += b.leftOutActive;
  if (!a.nonFinite) a.nonFinite = b.nonFinite;
  return a;
}

/// Sums in float64 by a tree that depends on the number of pairs only, so that the result is
/// bit-identical for any number of threads.
ErrorSums sumErrors(std::span<const BrickPair> pairs, const ErrorDomain& domain) {
  using Range = tbb::blocked_range<std::size_t>;
  constexpr std::size_t kPairsPerTask = 64;
  return parallelDeterministicReduce(
      Range(0, pairs.size(), kPairsPerTask), ErrorSums{},
      [&](const Range& range, ErrorSums sums) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) addPair(pairs[i], domain, sums);
        return sums;
      },
      joined);
}

/// The first voxel of the box outside all pairs. The search makes at most one step for each pair,
/// because every step passes a pair.
Coord firstFreeVoxel(std::span<const BrickPair> pairs, const Box& box) {
  const Box bricks{brickOf(box.min), brickOf(box.max)};
  Coord place = bricks.min;
  for (const BrickPair& pair : pairs) {
    if (!bricks.contains(pair.brick)) continue;
    if (pair.brick != place) break;
    if (++place.z <= bricks.max.z) continue;  // the next brick of the box in the order of Coord
    place.z = bricks.min.z;
    if (++place.y <= bricks.max.y) continue;
    place.y = bricks.min.y;
    ++place.x;
  }
  return maxCoord(place * kBrickSide, box.min);
}

/// Adds the voxels of the box that lie in no brick; their error is the backgrounds' difference.
void addEmptySpace(ErrorSums& sums, std::span<const BrickPair> pairs, const ErrorDomain& domain) {
  const double empty = domain.box.volume() - sums.voxels;
  const double error = std::abs(domain.backgrounds.reference - domain.backgrounds.candidate);
  if (empty < 1.0) return;
  sums.squaredError += empty * error * error;
  if (error > sums.maxError) sums.keepLargest(error, firstFreeVoxel(pairs, domain.box));
}

/// Two volumes that are being compared.
struct Comparison {
  double peak = 0.0;
  ErrorDomain domain;
  std::vector<BrickPair> pairs;
  ErrorSums sums;

  /// Voxels of the box that count.
  [[nodiscard]] double voxels() const { return domain.box.volume() - double(sums.leftOut); }
  [[nodiscard]] double mseBox() const {
    return voxels() > 0.0 ? sums.squaredError / voxels() : 0.0;
  }
};

[[noreturn]] void refuseNonFinite(const SparseVolume& reference, const SparseVolume& candidate,
                                  Coord at) {
  const auto name = [](float value) -> std::string {
    if (std::isnan(value)) return "NaN";
    if (std::isinf(value)) return value > 0.0f ? "infinity" : "minus infinity";
    return "a number";
  };
  const std::string a = name(valueAt(reference, at)), b = name(valueAt(candidate, at));
  // Such values at voxels that are not active in both volumes have the same name.
  throw BadInput("the value at " + toString(at) + " is not finite: it is " + a +
                 " in the reference" +
                 (a == b ? ", and not active in both" : ", and " + b + " in the other one"));
}

Comparison compared(const SparseVolume& reference, const SparseVolume& candidate,
                    const CompareOptions& options) {
  if (activeVoxelCount(reference) == 0) throw BadInput("the reference has no active voxel");
  Comparison c;
  c.domain = {options.box.value_or(activeBox(reference)),
              {reference.background, candidate.background}};
  const Box& box = c.domain.box;
  if (box.empty())
    throw UsageError("the box from " + toString(box.min) + " to " + toString(box.max) +
                     " has no voxel");
  c.pairs = metrics::pairBricks(reference, candidate);
  c.sums = sumErrors(c.pairs, c.domain);
  if (c.sums.nonFinite) refuseNonFinite(reference, candidate, *c.sums.nonFinite);
  if (!std::isfinite(reference.background) || !std::isfinite(candidate.background))
    throw BadInput("the background is not finite");
  c.peak = options.peak ? *options.peak : peakOf(reference);
  if (!(c.peak > 0.0) || !std::isfinite(c.peak))
    throw UsageError("the peak must be positive, not " + std::to_string(c.peak));
  addEmptySpace(c.sums, c.pairs, c.domain);
  return c;
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

namespace {

/// The figures that follow from the sums.
VolumeMetrics figuresOf(const Comparison& c) {
  const ErrorSums& sums = c.sums;
  VolumeMetrics m;
  m.peak = c.peak;
  m.boxVoxels = c.voxels();
  m.nonFinite = sums.leftOutActive;
  m.activeVoxels = sums.activeReference - sums.leftOutActive;
  m.mseBox = c.mseBox();
  m.mseActive = m.activeVoxels > 0 ? sums.squaredErrorActive / double(m.activeVoxels) : 0.0;
  m.psnrBox = psnr(m.mseBox, m.peak);
  m.psnrActive = psnr(m.mseActive, m.peak);
  m.maxError = std::max(sums.maxError, 0.0);  // below 0 if no voxel counts
  m.maxErrorAt = sums.maxErrorAt;
  const std::uint64_t either = sums.activeUnion - sums.leftOutActive;
  if (either > 0) m.iou = double(sums.activeIntersection - sums.leftOutActive) / double(either);
  m.massReference = sums.massReference;
  m.massCandidate = sums.massCandidate;
  return m;
}

/// Adds what the volumes have lost of doubles. The root of a sum of squares is at most the sum of the roots.
void addNarrowing(const Narrowing& narrowing, VolumeMetrics& m) {
  if (narrowing.errors.count() == 0) return;
  const auto add = [&](double voxels, double& mse, double& decibels) {
    if (!(voxels > 0.0)) return;
    const double root = std::sqrt(mse) + std::sqrt(narrowing.squares / voxels);
    mse = root * root;
    decibels = psnr(mse, m.peak);
  };
  add(m.boxVoxels, m.mseBox, m.psnrBox);
  add(double(m.activeVoxels), m.mseActive, m.psnrActive);
  if (m.maxError == 0.0) m.maxErrorAt = narrowing.errors.first();
  m.maxError += narrowing.largest();
  m.p999Error += narrowing.largest();
}

/// Adds the figures that need the volumes, all of whose values are finite.
void addFigures(const SparseVolume& reference, const SparseVolume& candidate,
                const CompareOptions& options, const Comparison& c, VolumeMetrics& m) {
  constexpr std::uint64_t kP999Permille = 999;
  const std::uint64_t either = c.sums.activeUnion - c.sums.leftOutActive;
  if (either > 0)
    m.p999Error = metrics::errorOfRank(c.pairs, metrics::nearestRank(either, kP999Permille));
  if (options.ssim) m.ssim = ssim3d(reference, candidate, c.domain.box, c.peak);
  if (options.transmittance)
    m.transmittance = transmittancePsnr(reference, candidate, c.domain.box);
}

}  // namespace

VolumeMetrics compareVolumes(const SparseVolume& reference, const SparseVolume& candidate,
                             const CompareOptions& options) {
  Comparison c = compared(reference, candidate, options);
  VolumeMetrics m = figuresOf(c);
  if (m.nonFinite == 0) {
    addFigures(reference, candidate, options, c, m);
    addNarrowing(options.narrowing, m);
    return m;
  }
  SparseVolume a = reference, b = candidate;
  dropNonFinite(a);
  dropNonFinite(b);
  c.pairs = metrics::pairBricks(a, b);
  addFigures(a, b, options, c, m);
  addNarrowing(options.narrowing, m);
  return m;
}

double psnrOverBox(const SparseVolume& reference, const SparseVolume& candidate,
                   const CompareOptions& options) {
  const Comparison c = compared(reference, candidate, options);
  return psnr(c.mseBox(), c.peak);
}

// Errors relative to each value.

double leastMagnitude(const SparseVolume& volume) {
  double least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double magnitude = std::abs(double(volume.brickValues(b)[std::size_t(v)]));
      if (!volume.active[b].test(v) || !(magnitude > 0.0)) continue;
      least = std::min(least, magnitude);
      most = std::max(most, magnitude);
    }
  return most < kLeastNormalFloat ? least : std::max(least, kLeastNormalFloat);
}

RelativeError largestRelativeError(const SparseVolume& reference, const SparseVolume& candidate,
                                   std::optional<double> floor) {
  const double least = floor ? *floor : leastMagnitude(reference);
  const auto pairs = metrics::pairBricks(reference, candidate);
  const auto errorAt = [&](const BrickPair& pair, int v) {
    const double error = std::abs(pair.errorAt(v));
    if (error == 0.0 || areEqualNonFinite(pair, v)) return RelativeError{};
    const double share = error / std::max(std::abs(double(pair.referenceAt(v))), least);
    return RelativeError{std::isnan(share) ? std::numeric_limits<double>::infinity() : share,
                         pair.voxelAt(v)};
  };
  const auto larger = [](const RelativeError& a, const RelativeError& b) {
    return b.share > a.share ? b : a;
  };
  return parallelDeterministicReduce(
      tbb::blocked_range<std::size_t>(0, pairs.size()), RelativeError{},
      [&](const auto& range, RelativeError largest) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          for (int v = 0; v < kBrickVoxels; ++v) largest = larger(largest, errorAt(pairs[i], v));
        return largest;
      },
      larger);
}

// Vectors.

namespace {

double peakOfLengths(const SparseVolume& lengths) {
  const double longest = activeRange(lengths).max;
  return longest > 0.0 ? longest : 1.0;
}

}  // namespace

double peakOfVectors(const VectorVolume& reference) {
  return peakOfLengths(magnitudeOf(reference));
}

double valueRangeOfVectors(const VectorVolume& reference) {
  double largest = 0.0;
  for (const SparseVolume& component : aligned(reference))
    largest = std::max(largest, valueRangeOf(component));
  return largest;
}

namespace {

/// What the lengths of vectors lose is at most what the vectors lose.
Narrowing ofLengths(const VectorNarrowing& components) {
  Narrowing lengths;
  double largestSquared = 0.0;
  for (const Narrowing& component : components) {
    largestSquared += component.largest() * component.largest();
    lengths.squares += component.squares;
  }
  if (largestSquared > 0.0) lengths.errors.add(std::sqrt(largestSquared), Coord{});
  return lengths;
}

}  // namespace

VectorMetrics compareVectors(const VectorVolume& reference, const VectorVolume& candidate,
                             const CompareOptions& options, const VectorNarrowing& narrowing) {
  const VectorVolume a = aligned(reference), b = aligned(candidate);
  const SparseVolume lengths = magnitudeOf(a);
  CompareOptions same = options;
  if (!same.peak) same.peak = peakOfLengths(lengths);
  same.narrowing = ofLengths(narrowing);
  VectorMetrics metrics{compareVolumes(lengths, magnitudeOf(b), same), {}};
  for (std::size_t c = 0; c < kComponents; ++c) {
    same.narrowing = narrowing[c];
    metrics.components[c] = compareVolumes(a[c], b[c], same);
  }
  return metrics;
}

// The change from a frame to the next.

SparseVolume temporalDifference(const FramePair& frames) {
  const auto pairs = metrics::pairBricks(frames.before, frames.after);
  Coord first = pairs.empty() ? Coord{} : pairs.front().brick;
  for (const BrickPair& pair : pairs) first = minCoord(first, pair.brick);
  SparseVolume change;
  change.values = VoxelArray<float>(memoryOf(frames.after));
  change.origin = first * kBrickSide;
  change.background = frames.after.background - frames.before.background;
  change.values.resize(pairs.size() * kBrickVoxels);
  for (std::size_t b = 0; b < pairs.size(); ++b) {
    const BrickPair& pair = pairs[b];
    BrickMask& active = change.active.emplace_back();
    change.bricks.push_back(pair.brick - first);
    const auto out = change.brickValues(b);
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (pair.isAnyActive(v)) active.set(v);
      out[std::size_t(v)] = float(pair.candidateAt(v) - pair.referenceAt(v));
    }
  }
  return change;
}

double temporalPsnr(const FramePair& reference, const FramePair& candidate,
                    const CompareOptions& options) {
  const bool before = activeVoxelCount(reference.before) > 0;
  const bool after = activeVoxelCount(reference.after) > 0;
  if (!before && !after) throw BadInput("the reference has no active voxel in two frames");
  const SparseVolume expected = temporalDifference(reference);
  CompareOptions own = options;
  if (!own.box) own.box = activeBox(expected);
  if (!own.peak)
    own.peak =
        std::max(before ? peakOf(reference.before) : 0.0, after ? peakOf(reference.after) : 0.0);
  return psnrOverBox(expected, temporalDifference(candidate), own);
}

// Signs.

SignErrors compareSigns(const SparseVolume& reference, const SparseVolume& candidate) {
  const EmptySigns emptyReference(reference), emptyCandidate(candidate);
  SignErrors errors;
  for (const BrickPair& pair : metrics::pairBricks(reference, candidate)) {
    const bool emptyA = !pair.reference && emptyReference.isInside(pair.brick);
    const bool emptyB = !pair.candidate && emptyCandidate.isInside(pair.brick);
    for (int v = 0; v < kBrickVoxels; ++v) {
      const bool a = pair.reference ? pair.reference[v] < 0.0f : emptyA;
      const bool b = pair.candidate ? pair.candidate[v] < 0.0f : emptyB;
      if (a != b && errors.voxels++ == 0) errors.first = pair.voxelAt(v);
    }
  }
  return errors;
}

}  // namespace esvr
