#pragma once
/// Coarser forms of a grid: fewer of its ellipsoids, the ones that matter most.

#include <cstddef>

#include "esvr/container.h"

namespace esvr {

/// The grid of its first importance layers, without a residual; itself where it has no more.
[[nodiscard]] StoredGrid firstLayers(StoredGrid grid, std::size_t layers);

/// The grid of its `count` heaviest ellipsoids, in their order; itself where it has no more. The
/// weight is |I| sqrt(s1 s2 s3), the root of the sum of squares over voxels up to a factor that all
/// ellipsoids of a kappa share. Fewer than all are no longer quantised, have no layers and no
/// residual.
[[nodiscard]] StoredGrid heaviest(StoredGrid grid, std::size_t count);

}  // namespace esvr
