#pragma once
/// How far off the first layers of a grid are.

#include <vector>

#include "esvr/container.h"
#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// For each prefix of the layers, the voxels that a reader gets of it against the source; nothing
/// where there is but one layer. \param box  of the PSNR
[[nodiscard]] std::vector<LayerError> measureLayers(const StoredGrid& grid,
                                                    const SparseVolume& source, const Box& box);

}  // namespace esvr
