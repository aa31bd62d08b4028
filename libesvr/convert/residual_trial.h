#pragma once
/// Predicts whether ellipsoids with a residual take fewer bytes than voxels within the same bound.

#include "convert/attempt.h"

namespace esvr::convert {

/// The bytes of ellipsoids with a residual, relative to those of voxels, in a sample of bricks. A
/// short fit of the sample, which takes at most 0.2 s, shows whether they can be smaller at all.
/// Where they can, a fit with as many iterations as a fit of the whole volume gives the ratio. The
/// ratio of the whole volume is up to 0.09 larger, and much larger if the volume repeats or mirrors
/// itself, which a sample does not show (docs/lab-notes.md, "Deciding on a residual").
/// \param share  bytes of the ellipsoids without their residual, relative to those of the voxels
[[nodiscard]] double residualRatio(const Job& job, double bound, double share);

}  // namespace esvr::convert
