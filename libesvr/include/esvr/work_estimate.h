#pragma once
/// Estimates the work and memory that the evaluation of a field needs. The estimate follows from
/// the supports of the ellipsoids and needs no evaluation, so that a program can refuse work that
/// it could not finish.

#include <limits>

#include "esvr/coord.h"
#include "esvr/ellipsoids.h"
#include "esvr/voxel_memory.h"

namespace esvr {

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
