#pragma once
/// Conversions of narrow bands, which keep the sign of every voxel.

#include <functional>

#include "encode/job.h"

namespace esvr::encode {

/// Converts a job as if it were no narrow band.
using ConvertTo = std::function<Conversion(const Job&)>;

/// Converts a narrow band. Ellipsoids get a residual (withSigns) where a sign is wrong. For a SizeGoal,
/// they are then converted again with fewer bytes, so that the residual fits in. With
/// Representation::kAuto, voxels are stored if the residual makes ellipsoids larger than them or too
/// large.
/// \throws UsageError  ellipsoids and their residual do not fit into the size
/// Other exceptions are those of `convertTo`.
[[nodiscard]] Conversion convertNarrowBand(const Job& job, const ConvertTo& convertTo);

/// Checks that a decoded narrow band has the signs of its source, in its bricks and elsewhere.
/// \throws RuntimeFailure  a sign differs; the text names the grid and the voxel
void requireSigns(const ConvertInput& input, const SparseVolume& decoded);

}  // namespace esvr::encode
