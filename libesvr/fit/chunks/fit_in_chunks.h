#pragma once
/// Fits a volume chunk by chunk (docs/scale.md).

#include <span>

#include "esvr/fit.h"
#include "fit/chunks/divide_bricks.h"
#include "fit/target.h"

namespace esvr {

/// Fits all chunks in rounds, in which the ellipsoids of the other chunks are constants. The result
/// does not depend on where and in which order options.parts runs the parts of a round.
/// \param scale   scaleOf(volume)
/// \param chunks  at least two
[[nodiscard]] FitResult fitInChunks(const SparseVolume& volume, const FitOptions& options,
                                    const TargetScale& scale, std::span<const BrickChunk> chunks);

}  // namespace esvr
