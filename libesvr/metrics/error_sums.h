#pragma once
/// Sums over pairs of bricks from which the metrics follow.

#include <cstdint>
#include <optional>
#include <span>

#include "esvr/coord.h"
#include "metrics/brick_pairs.h"

namespace esvr::metrics {

struct ErrorSums {
  // over the voxels of the bricks that lie in the box
  double voxels = 0.0;
  double squaredError = 0.0;
  double massReference = 0.0, massCandidate = 0.0;
  double maxError = -1.0;  ///< below any error: no voxel yet
  Coord maxErrorAt;

  // over the whole lattice
  double squaredErrorActive = 0.0;  ///< over the reference's active voxels
  std::uint64_t activeReference = 0, activeUnion = 0, activeIntersection = 0;
  std::optional<Coord> nonFinite;  ///< the first voxel whose error is not a number or infinite
};

/// The sums, and the parts of space that they go over.
struct ErrorDomain {
  Box box;
  Backgrounds backgrounds;
};

/// Sums in float64 along a tree that depends on the number of pairs only: the same bits for any
/// number of threads.
[[nodiscard]] ErrorSums sumErrors(std::span<const BrickPair> pairs, const ErrorDomain& domain);

}  // namespace esvr::metrics
