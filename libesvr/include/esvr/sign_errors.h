#pragma once
/// Counts the voxels of a level set whose sign is not that of a reference.

#include <cstdint>
#include <optional>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr {

struct SignErrors {
  std::uint64_t voxels = 0;      ///< voxels with another sign than in the reference
  std::optional<Coord> first{};  ///< index coordinates of one of them
};

/// Compares the signs of all voxels in the bricks of either volume, active or not. A voxel is
/// negative (inside) or not; 0 is outside. Where a volume has no brick, the sign is that of
/// EmptySigns (empty_signs.h). Elsewhere, neither volume has a brick; if no voxel is counted and the
/// signs around the empty space of both volumes agree, the signs are the same there, too.
[[nodiscard]] SignErrors compareSigns(const SparseVolume& reference, const SparseVolume& candidate);

}  // namespace esvr
