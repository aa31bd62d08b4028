#pragma once
/// Sums over pairs of bricks, from which the metrics are computed.

#include <cstdint>
#include <optional>
#include <span>

#include "esvr/coord.h"
#include "metrics/brick_pairs.h"

namespace esvr::metrics {

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
  std::optional<Coord> nonFinite;  ///< the first voxel whose error is not a number or infinite
};

/// The box of the sums and the values outside bricks.
struct ErrorDomain {
  Box box;
  Backgrounds backgrounds;
};

/// Sums in float64 by a tree that depends on the number of pairs only, so that the result is
/// bit-identical for any number of threads.
[[nodiscard]] ErrorSums sumErrors(std::span<const BrickPair> pairs, const ErrorDomain& domain);

}  // namespace esvr::metrics
