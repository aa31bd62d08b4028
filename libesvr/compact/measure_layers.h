#pragma once
/// Errors of the importance layers of a grid.

#include <vector>

#include "esvr/container.h"
#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Compares the voxels that a reader gets from the first k layers with the source, for each k.
/// \param box  box over which PSNR is measured
/// \return a row for each k; empty if there is only one layer
[[nodiscard]] std::vector<LayerError> measureLayers(const StoredGrid& grid,
                                                    const SparseVolume& source, const Box& box);

}  // namespace esvr
