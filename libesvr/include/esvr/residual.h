#pragma once
/// A residual bounds the error of every voxel: it corrects the sum of ellipsoids wherever the error
/// of the sum exceeds the bound.

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
/// \return nothing if the grid is a narrow band, or if the margin exceeds a sixth of the bound
[[nodiscard]] std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source,
                                                     double bound);

}  // namespace esvr
