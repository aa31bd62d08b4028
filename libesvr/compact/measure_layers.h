#pragma once
/// Errors of the importance layers of a grid.

#include <vector>

#include "esvr/container.h"
#include "esvr/metrics.h"
#include "esvr/volume.h"

namespace esvr {

/// Compares the voxels that a reader gets from the first k layers with the source, for each k.
/// \param options  box and peak of the PSNR
/// \return a row for each k; empty if there is only one layer
[[nodiscard]] std::vector<LayerError> measureLayers(const StoredGrid& grid,
                                                    const SparseVolume& source,
                                                    const CompareOptions& options);

}  // namespace esvr
