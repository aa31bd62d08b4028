#pragma once
/// How much work and memory it takes to turn a field into voxels. It is known from the supports of
/// the ellipsoids before anything is evaluated, so that a program can refuse what it cannot finish.

#include <limits>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"

namespace esvr {

/// All figures are upper bounds.
struct WorkEstimate {
  double ellipsoids = 0.0;
  double pairs = 0.0;   ///< an ellipsoid and a brick that it reaches make a pair
  double bricks = 0.0;  ///< bricks that are evaluated and kept
  [[nodiscard]] double bytes() const;
};

struct EstimateOptions {
  /// Only these voxels are wanted.
  Box within = Box::whole();
  /// No more bricks than these are evaluated.
  double maxBricks = std::numeric_limits<double>::infinity();
  /// An estimate of more bytes than these is made again with more care: bricks that several
  /// ellipsoids reach are then counted once.
  double enough = std::numeric_limits<double>::infinity();
};

/// Estimates what evaluating a field takes on the bricks that its ellipsoids reach.
[[nodiscard]] WorkEstimate estimateWork(const Field& field, const EstimateOptions& options = {});

}  // namespace esvr
