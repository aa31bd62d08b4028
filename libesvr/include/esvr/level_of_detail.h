#pragma once
/// Coarser levels of detail of a grid: the most important of its ellipsoids.

#include <cstddef>

#include "esvr/container.h"

namespace esvr {

/// Keeps the first importance layers of a grid and drops its residual. A grid that has no more
/// layers is returned unchanged.
[[nodiscard]] StoredGrid firstLayers(StoredGrid grid, std::size_t layers);

/// Keeps the `count` ellipsoids of the largest weight of a grid, in their order. The weight is
/// |I| sqrt(s1 s2 s3): the root of the ellipsoid's sum of squares over voxels, up to a factor that
/// depends on kappa only. The result has no quantised form, no layers and no residual. A grid that
/// has no more ellipsoids is returned unchanged.
[[nodiscard]] StoredGrid heaviest(StoredGrid grid, std::size_t count);

}  // namespace esvr
