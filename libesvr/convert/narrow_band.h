#pragma once
/// Conversions of narrow bands, which keep the sign of every voxel.

#include <functional>

#include "convert/attempt.h"

namespace esvr::convert {

/// Converts a narrow band with the function that converts other grids. With Representation::kAuto,
/// voxels are stored for all goals but a FitGoal, unless the volume is large: ellipsoids would need
/// a residual for their signs. Ellipsoids get one (withSigns) where a sign is wrong. For a SizeGoal,
/// they are converted again so that the residual fits in.
/// \throws UsageError  ellipsoids and their residual do not fit into the size
/// Other exceptions are those of `convertTo`.
[[nodiscard]] Conversion convertNarrowBand(const Job& job,
                                           const std::function<Conversion(const Job&)>& convertTo);

/// Checks that a decoded narrow band has the signs of its source, in its bricks and elsewhere.
/// \throws RuntimeFailure  a sign differs; the text names the grid and the voxel
void requireSigns(const ConvertInput& input, const SparseVolume& decoded);

}  // namespace esvr::convert
