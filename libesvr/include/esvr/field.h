#pragma once
/// Evaluates sums of ellipsoids, and estimates the work that this takes.

#include <array>
#include <cstddef>
#include <cstdint>
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

}  // namespace esvr
