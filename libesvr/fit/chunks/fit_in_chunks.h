#pragma once
/// Fits a volume chunk by chunk (docs/scale.md).

#include <span>

#include "esvr/fit.h"
#include "fit/chunks/divide_bricks.h"

namespace esvr {

/// Fits each chunk with the ellipsoids of the chunks before it as constants, and then all of them
/// again for a part of the iterations, with those of all other chunks as constants. The result does
/// not depend on the order in which the chunks of a group (groupChunks) are fitted.
/// \param chunks  at least two
[[nodiscard]] FitResult fitInChunks(const SparseVolume& volume, const FitOptions& options,
                                    std::span<const BrickChunk> chunks);

}  // namespace esvr
