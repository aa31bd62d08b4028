#pragma once
/// Evaluates a Field on bricks. Ellipsoids are gathered in their order in the field, brick by
/// brick, so a result is the same bits for any number of threads (the calling TBB arena's).

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Index corners (multiples of 8, increasing) of all bricks that the support of an ellipsoid
/// reaches. Outside them the field is exactly the background. Found by an exact test of brick
/// against ellipsoid up to rounding, which errs on the side of inclusion.
/// \param within  bricks without a voxel in this box are left out
/// \throws MemoryExceeded  there may be more than 2^32 pairs of an ellipsoid and a brick
[[nodiscard]] std::vector<Coord> reachedBricks(const Field& field,
                                               const Box& within = Box::whole());

/// V at the voxels of bricks, float32, SIMD. Each value is within 4e-6 * sum |I_i| of the reference
/// (evaluateReference) for aspect ratios up to 100, 2e-4 * sum |I_i| up to 1000.
/// \param corners  index corners, multiples of 8
/// \param out      kBrickVoxels a brick, in voxelOffset order
void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out);

struct EllipsoidHits {
  std::uint64_t pairs = 0;   ///< an ellipsoid and a voxel that its support holds make a pair
  std::uint64_t voxels = 0;  ///< that any support holds
};
/// \param corners  index corners of the bricks whose voxels count, multiples of 8
[[nodiscard]] EllipsoidHits countHits(const Field& field, std::span<const Coord> corners);

/// Average number of ellipsoids whose support holds a voxel, over the voxels that any does (the
/// paper's 'average ellipsoid hits'); 0 where there are none.
[[nodiscard]] double averageHits(const Field& field);

/// The same as evaluateBricks in float64 by the definition: sums every ellipsoid at every voxel.
/// For tests and checks.
[[nodiscard]] double evaluateReference(const Field& field, Coord voxel);

/// How the field becomes voxels again.
struct RevoxeliseOptions {
  float threshold = 0.0f;             ///< active where |V - background| > threshold
  std::optional<ValueRange> range{};  ///< values beyond it become its ends
  /// A level set, whose background is half the width of its band: active where
  /// |V| < background - threshold; what is not active holds the background with the sign of V.
  bool narrowBand = false;
  /// Evaluate in these bricks only (increasing index corners); default: all that are reached.
  std::span<const Coord> bricks{};
  bool restrictToBricks = false;
};

/// Voxels that are not active hold the background, as `narrowBand` says; bricks without an active
/// voxel are dropped. \throws RuntimeFailure  bricks that are 2^31 voxels or more apart;
/// MemoryExceeded: as reachedBricks
[[nodiscard]] SparseVolume revoxelise(const Field& field, const RevoxeliseOptions& options);

}  // namespace esvr
