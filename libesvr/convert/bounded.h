#pragma once
/// Conversions that bound the error of every voxel: voxels, or ellipsoids with a residual.

#include "convert/attempt.h"

namespace esvr::convert {

/// The largest absolute error that a goal allows; nothing for a goal without a bound.
[[nodiscard]] std::optional<double> boundOf(const Goal& goal, const SparseVolume& source);

/// The smaller of two grids: voxels, or ellipsoids with a residual. The ellipsoids get a quarter of
/// the bytes of the voxels. The volume is fitted only if fits of a sample of bricks promise that
/// this saves a part of the bytes (residualRatio()). Ellipsoids are smaller for smooth values and
/// larger for noisy ones (docs/figures/benchmarks.md, "Voxels or a residual within an error bound").
[[nodiscard]] Conversion convertWithin(const Job& job, const BoundGoal& goal);

/// A grid that holds the exact voxels and the exact active mask.
/// \throws UsageError  the values are doubles, which were rounded to float32
[[nodiscard]] Conversion convertLossless(const Job& job);

}  // namespace esvr::convert
