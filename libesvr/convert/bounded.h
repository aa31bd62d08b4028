#pragma once
/// A bound on the error of every voxel: voxels, or ellipsoids with a residual.

#include "convert/attempt.h"

namespace esvr::convert {

/// The largest absolute error that a goal allows.
[[nodiscard]] double boundOf(const BoundGoal& goal, const SparseVolume& source);

/// The smaller of the two. Ellipsoids are tried with a quarter of the bytes that voxels alone take:
/// a short fit first, a whole one where that comes near. Where values are noise to ellipsoids they
/// do not pay, where values are smooth they do (docs/benchmarks.md).
[[nodiscard]] Conversion convertWithin(const Job& job, const BoundGoal& goal);

/// Voxels and mask as they are. \throws UsageError  doubles, which are read as float32
[[nodiscard]] Conversion convertLossless(const Job& job);

}  // namespace esvr::convert
