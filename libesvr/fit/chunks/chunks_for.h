#pragma once
/// Decides into which chunks a volume is divided.

#include <vector>

#include "esvr/fit.h"
#include "fit/chunks/divide_bricks.h"

namespace esvr {

/// The chunks in which a volume is fitted: those of options.chunkVoxels, or the largest ones whose
/// fits stay within the memory of the GPU and within options.maxHostBytes.
/// \return no or one chunk if the volume needs no division
[[nodiscard]] std::vector<BrickChunk> chunksFor(const SparseVolume& volume,
                                                const FitOptions& options);

}  // namespace esvr
