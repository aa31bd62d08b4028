#pragma once
/// From a fitted field to what a file stores of a grid, and from there back to voxels.

#include <optional>

#include "esvr/container.h"
#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "esvr/grid_descriptor.h"
#include "esvr/memory_limit.h"
#include "esvr/sparse_volume.h"
#include "esvr/voxel_layer.h"
#include "esvr/work_estimate.h"

namespace esvr {

/// Completes a fitted field with what the file says of its source, and chooses the rule by which
/// active voxels are found again:
///  - usually a threshold, the one whose active voxels overlap best with the source's (intersection
///    over union) among those that add no squared error worth telling (0.004 dB);
///  - in a narrow band, the band itself in the source's bricks;
///  - where no threshold brings a voxel back, since all values equal the background, and where it
///  is
///    asked for (`activity`), the source's mask.
/// The curve is left empty.
[[nodiscard]] StoredGrid makeStoredGrid(const GridDescriptor& descriptor,
                                        const SparseVolume& source, Field field,
                                        Activity activity = Activity::kByValue);

/// True for a level set with a half width that none of its active voxels exceeds: what
/// makeStoredGrid stores as a narrow band, and FitOptions::narrowBand is meant for. A level set
/// that is active beyond its half width, or has none, is fitted and stored like any other grid.
[[nodiscard]] bool isNarrowBand(const GridDescriptor& descriptor, const SparseVolume& source);

/// A grid that holds its voxels and no ellipsoids. \param layer  of `source` (voxel_layer.h)
[[nodiscard]] StoredGrid makeStoredVoxels(const GridDescriptor& descriptor,
                                          const SparseVolume& source, VoxelLayer layer);

/// By what rule decodeGrid() makes voxels of the sum: the grid's threshold, range and band, without
/// its bricks, mask and residual.
[[nodiscard]] RevoxeliseOptions voxelRule(const StoredGrid& grid);

struct DecodeOptions {
  std::optional<float> threshold{};  ///< instead of the grid's own; 0 or above
  /// Voxels elsewhere come back inactive; bricks elsewhere are not evaluated.
  std::optional<Box> box{};
  /// Bound on the memory that evaluating and keeping the voxels takes.
  std::uint64_t maxBytes = kNoMemoryLimit;
};

/// Bounds the work and memory of decodeGrid(). Nothing is evaluated.
[[nodiscard]] WorkEstimate estimateDecode(const StoredGrid& grid,
                                          const DecodeOptions& options = {});

/// The voxels that a file gives back. \throws UsageError  threshold negative or not finite;
/// MemoryExceeded: the estimate is above options.maxBytes, and nothing was begun
[[nodiscard]] SparseVolume decodeGrid(const StoredGrid& grid, const DecodeOptions& options = {});

}  // namespace esvr
