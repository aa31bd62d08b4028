#pragma once
/// Evaluates sums of ellipsoids, estimates the work that this takes, and measures its precision.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "esvr/ellipsoids.h"
#include "esvr/tone.h"
#include "esvr/volume.h"

namespace esvr {

// Evaluates a Field on bricks. Each brick sums its ellipsoids in their order in the field, so the
// result is bit-identical for any number of threads (those of the calling TBB arena).

/// Index corners (multiples of 8, increasing) of all bricks that the support of an ellipsoid
/// reaches. Outside these bricks the field is exactly the background. The test of a brick against
/// an ellipsoid is exact up to rounding; if rounding makes it uncertain, the brick is included.
/// \param within  bricks without a voxel in this box are left out
/// \throws MemoryExceeded  there may be more than 2^32 pairs of an ellipsoid and a brick
[[nodiscard]] std::vector<Coord> reachedBricks(const Field& field,
                                               const Box& within = Box::whole());

/// Evaluates V at all voxels of bricks in float32 with SIMD. Each value is within 4e-6 * sum |I_i|
/// of evaluateReference for aspect ratios up to 100, and within 2e-4 * sum |I_i| up to 1000.
/// \param corners  index corners of the bricks, multiples of 8
/// \param out      kBrickVoxels values for each brick, in voxelOffset order
void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out);

/// A place in index coordinates, which need not be a voxel.
using Place = std::array<double, 3>;

/// Evaluates V at any places in float32, without clamping. The error is that of evaluateBricks.
/// \param places  finite coordinates within those of voxels
/// \param out     a value for each place
/// \throws UsageError  a place is not finite or lies outside the index space
/// \throws MemoryExceeded  as for reachedBricks
void evaluatePlaces(const Field& field, std::span<const Place> places, std::span<float> out);

/// Average number of ellipsoids whose support contains a voxel, over the voxels that lie in at
/// least one support (the paper's 'average ellipsoid hits'); 0 if there is no such voxel.
[[nodiscard]] double averageHits(const Field& field);

/// V at one voxel in float64, by the definition: the sum over all ellipsoids. Tests and checks use
/// it.
[[nodiscard]] double evaluateReference(const Field& field, Coord voxel);

/// The rule by which a field becomes voxels.
struct RevoxeliseOptions {
  ToneCurve tone{};        ///< V is the value of the sum by this curve; needs a background of 0
  float threshold = 0.0f;  ///< a voxel is active if |V - background| > threshold
  std::optional<ValueRange> range{};  ///< values are clamped to this range
  /// The field is a level set, whose background is half the width of its band: a voxel is active if
  /// |V| < background - threshold. Inactive voxels hold the background with the sign of V.
  bool narrowBand = false;
  /// If `restrictToBricks` is set, only these bricks are evaluated (increasing index corners);
  /// otherwise all bricks that ellipsoids reach.
  std::span<const Coord> bricks{};
  bool restrictToBricks = false;
  /// If this is not empty, the voxels of these masks, one for each of `bricks`, are active whatever
  /// their values, and no others. It needs `restrictToBricks`.
  std::span<const BrickMask> masks{};
  Box box = Box::whole();  ///< no voxel outside this box is active
  /// Voxels (index coordinates) of `box` that are active whatever their values. With `restrictToBricks`,
  /// they lie in `bricks`, and there are no masks.
  std::span<const Coord> alwaysActive{};
  VoxelMemory memory{};  ///< holds the voxels
};

/// Converts a field to voxels. Inactive voxels hold the background (with a sign if `narrowBand` is
/// set), and bricks without an active voxel are dropped.
/// \throws RuntimeFailure  bricks are 2^31 voxels or more apart
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options);

// Estimates the work and memory that the evaluation of a field needs. The estimate follows from
// the supports of the ellipsoids and needs no evaluation, so that a program can refuse work that
// it could not finish.

/// All figures are upper bounds.
struct WorkEstimate {
  double ellipsoids = 0.0;
  double pairs = 0.0;   ///< pairs of an ellipsoid and a brick that its support reaches
  double bricks = 0.0;  ///< bricks that are evaluated and kept
  /// \param memory  holds the voxels; those in a file do not count
  [[nodiscard]] double bytes(const VoxelMemory& memory = {}) const;
};

struct EstimateOptions {
  /// Only these voxels are evaluated.
  Box within = Box::whole();
  /// At most this many bricks are evaluated.
  double maxBricks = std::numeric_limits<double>::infinity();
  /// If the estimate exceeds this number of bytes, a slower and tighter estimate is made, which
  /// counts a brick once even if several ellipsoids reach it.
  double enough = std::numeric_limits<double>::infinity();
  VoxelMemory memory{};  ///< see WorkEstimate::bytes
};

/// Estimates the evaluation of a field on the bricks that its ellipsoids reach.
[[nodiscard]] WorkEstimate estimateWork(const Field& field, const EstimateOptions& options = {});

// Measures how precisely a field is evaluated in float32, and what makes its evaluation difficult.
// docs/math.md, "Rounding", derives the bound.

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

/// Evaluates bricks in float32. The arguments are those of evaluateBricks().
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
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] Stability measureStability(const Field& field, const StabilityOptions& options = {});

/// The number of leading decimal digits that a difference leaves correct: the largest whole d with
/// difference <= 10^-d peak, at most 17, which stands for no difference. 0 if the peak is 0 and there
/// is a difference, or if the difference is not finite.
[[nodiscard]] int correctDigits(double difference, double peak);

}  // namespace esvr
