#pragma once
/// A residual corrects the sum of ellipsoids voxel by voxel where its sign is wrong.

#include "esvr/container.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Corrects the sign of every voxel of a narrow band where the sum has another one than the source,
/// by a residual. A reader on any machine then finds the signs of the source: evaluations on different
/// machines differ by rounding (field.h), and the residual includes a margin for that.
/// \param grid  a narrow band without a residual that makeStoredGrid made from `source`
/// \return the grid without a residual if no sign is wrong
[[nodiscard]] StoredGrid withSigns(StoredGrid grid, const SparseVolume& source);

}  // namespace esvr
