#pragma once
/// A residual corrects the sum of ellipsoids voxel by voxel: where its error exceeds a bound, or
/// where its sign is wrong.

#include <cstdint>
#include <optional>

#include "esvr/container.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Adds a residual to a grid, so that every voxel of decodeGrid() is within `bound` of the source
/// on every machine. Evaluations on different machines differ by rounding (field.h); the residual
/// includes a margin for that. If the grid's topology is kThreshold, its threshold becomes half the
/// bound.
/// \param grid   a grid that makeStoredGrid made from `source`
/// \param bound  largest absolute error, above 0
/// \return nothing if the grid is a narrow band, or if the margin exceeds a sixth of the bound. If
///         decodeGrid() rounds to halfs, the bound is diminished by half of their distance for this.
[[nodiscard]] std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source,
                                                     double bound);

/// Corrects the sign of every voxel of a narrow band where the sum has another one than the source,
/// by a residual. A reader on any machine then finds the signs of the source, as above.
/// \param grid  a narrow band without a residual that makeStoredGrid made from `source`
/// \return the grid without a residual if no sign is wrong
[[nodiscard]] StoredGrid withSigns(StoredGrid grid, const SparseVolume& source);

}  // namespace esvr
