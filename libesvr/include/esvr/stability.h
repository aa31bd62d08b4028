#pragma once
/// Measures how precisely a field is evaluated in float32, and what makes its evaluation difficult.
/// docs/math.md, "Rounding", derives the bound.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The extremes of the ellipsoids of a field. All are 0 if it has none.
struct FieldExtremes {
  double smallestScale = 0.0, largestScale = 0.0;  ///< voxels
  double largestAspect = 0.0;     ///< largest scale of an ellipsoid divided by its smallest
  double largestCondition = 0.0;  ///< condition number of Sigma: the largest aspect squared
  double lowestKappa = 0.0, highestKappa = 0.0;
  double smallestIntensity = 0.0, largestIntensity = 0.0;  ///< magnitudes
};
[[nodiscard]] FieldExtremes extremesOf(const Field& field);

/// The arithmetic that evaluates a field, as far as the bound of its errors depends on it.
struct Arithmetic {
  /// Sums of a brick are integers in units of a part of its largest intensity, and numbers below the
  /// normal ones of float32 count as 0: the decoder on a GPU.
  bool integerSums = false;
};

/// Evaluates bricks in float32. The arguments are those of evaluateBricks() (field.h).
using EvaluateBricks =
    std::function<void(const Field& field, std::span<const Coord> corners, std::span<float> out)>;

struct StabilityOptions {
  std::size_t samples = 256;  ///< bricks that are compared, at least 1
  std::size_t worst = 5;      ///< bricks of the largest differences that are listed
  /// Index corners (multiples of 8, increasing) of the bricks from which samples are taken. Empty:
  /// all bricks that ellipsoids reach.
  std::span<const Coord> bricks{};
  Box within = Box::whole();          ///< bricks without a voxel in this box are left out
  std::optional<ValueRange> range{};  ///< both values are clamped to it before they are compared
  EvaluateBricks evaluate{};          ///< empty: evaluateBricks(), on the CPU
  Arithmetic arithmetic{};            ///< that of `evaluate`
};

/// The comparison of one brick.
struct BrickDifference {
  Coord corner;             ///< index corner of the brick
  Coord at;                 ///< voxel of the largest difference
  double largest = 0.0;     ///< largest difference, value units; infinite if a value is not finite
  double squares = 0.0;     ///< sum of the squares of the differences
  double bound = 0.0;       ///< largest bound of a voxel's difference
  double shareOfBound = 0;  ///< largest difference of a voxel, divided by its own bound
};

struct Stability {
  FieldExtremes extremes;
  std::size_t bricks = 0;                  ///< from which samples were taken
  std::size_t sampled = 0;                 ///< bricks that were compared
  double largest = 0.0, rms = 0.0;         ///< differences, value units
  double bound = 0.0, shareOfBound = 0.0;  ///< the largest of the bricks
  double peak = 0.0;  ///< largest |V - background| of the sampled voxels, before it is clamped
  /// Ellipsoids whose support contains a voxel: mean over the sampled voxels that lie in at least
  /// one support, and the largest number.
  double meanOverlap = 0.0;
  std::uint32_t largestOverlap = 0;
  /// Cancellation is the sum of the magnitudes of the terms of V - background, divided by the
  /// magnitude of their sum. The mean is the ratio of the two sums over the sampled voxels; the
  /// largest is that of a voxel where |V - background| is at least a hundredth of the peak. Both
  /// are 1 if all intensities have one sign, and if there is nothing to sum.
  double meanCancellation = 1.0, largestCancellation = 1.0;
  std::vector<BrickDifference> worst;  ///< those of the largest differences, the largest one first
};

/// Compares the float32 evaluation of a field with its definition in float64, on bricks that are
/// spread evenly over the list of all bricks, and on those in which the ellipsoids with the smallest
/// and the largest scale, the largest aspect ratio and the largest intensity are centered. The result
/// is the same on any number of threads.
/// \throws MemoryExceeded  as for reachedBricks (field.h)
[[nodiscard]] Stability measureStability(const Field& field, const StabilityOptions& options = {});

/// The number of leading decimal digits that a difference leaves correct: the largest whole d with
/// difference <= 10^-d peak, at most 17, which stands for no difference. 0 if the peak is 0 and there
/// is a difference, or if the difference is not finite.
[[nodiscard]] int correctDigits(double difference, double peak);

}  // namespace esvr
