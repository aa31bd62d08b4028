#pragma once
/// A bound on the error of every voxel, with ellipsoids: what their sum misses by more is stored.

#include <cstdint>
#include <optional>

#include "esvr/container.h"
#include "esvr/rate_control.h"
#include "esvr/sparse_volume.h"

namespace esvr {

/// The residual that keeps every voxel of decodeGrid() within `bound` of the source's, wherever the
/// file is read: evaluations differ by rounding between machines (field.h), for which a margin is
/// kept. By value, the grid's threshold becomes half the bound. Nothing where the margin would take
/// too much of the bound.
/// \param grid  as makeStoredGrid made it from `source`, no narrow band \param bound  above 0
[[nodiscard]] std::optional<StoredGrid> withResidual(StoredGrid grid, const SparseVolume& source,
                                                     double bound);

struct BoundedFit {
  std::optional<RatedGrid> rated;  ///< with its residual; nothing where voxels alone are smaller
  std::uint64_t bytes = 0;         ///< of the smallest grid with ellipsoids that was tried; 0: none
};

/// Tries ellipsoids of a quarter of the bytes that voxels alone take: a short fit first, a full one
/// where that comes near. Where voxels are noise to ellipsoids they do not pay, where they are
/// smooth they do (docs/benchmarks.md). \param voxelBytes  what the voxels alone add to a file
[[nodiscard]] BoundedFit fitWithin(const RateInput& input, double bound, std::uint64_t voxelBytes);

}  // namespace esvr
