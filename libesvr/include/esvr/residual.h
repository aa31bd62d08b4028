#pragma once
/// Keeps a bound on the error of every voxel beside ellipsoids: a residual holds what their sum
/// misses by more.

#include <cstdint>
#include <optional>

#include "esvr/container.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// Adds the residual that keeps every voxel of decodeGrid() within `bound` of the source's, wherever
/// the file is read. Evaluations differ by rounding between machines (field.h); the residual keeps a
/// margin for that. Where voxels are active by their values, the grid's threshold becomes half the
/// bound.
/// \param grid   as makeStoredGrid made it from `source`, no narrow band
/// \param bound  above 0
/// \return       nothing where the margin would take too much of the bound
[[nodiscard]] std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source,
                                                     double bound);

}  // namespace esvr
