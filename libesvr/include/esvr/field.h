#pragma once
/// Evaluates a Field on bricks. Each brick sums its ellipsoids in their order in the field, so the
/// result is bit-identical for any number of threads (those of the calling TBB arena).

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/block_levels.h"
#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr {

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
  float threshold = 0.0f;             ///< a voxel is active if |V - background| > threshold
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
  /// If this is not empty, `threshold` is that of level 0, and the blocks of `bricks` have these
  /// levels (block_levels.h). It needs `restrictToBricks`, and no masks.
  std::span<const BlockLevels> levels{};
  Box box = Box::whole();  ///< no voxel outside this box is active
  VoxelMemory memory{};    ///< holds the voxels
};

/// Converts a field to voxels. Inactive voxels hold the background (with a sign if `narrowBand` is
/// set), and bricks without an active voxel are dropped.
/// \throws RuntimeFailure  bricks are 2^31 voxels or more apart
/// \throws MemoryExceeded  as for reachedBricks
[[nodiscard]] SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options);

}  // namespace esvr
