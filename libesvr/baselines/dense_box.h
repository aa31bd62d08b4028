#pragma once
/// The voxels of a box as an array, for compressors that know no sparsity.

#include <array>
#include <cstdint>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr::baselines {

/// x fastest, as ZFP, SZ and raw files of images have it.
struct DenseBox {
  Box box;
  std::vector<float> values;

  [[nodiscard]] std::array<std::size_t, 3> side() const {
    return {std::size_t(box.max.x - box.min.x + 1), std::size_t(box.max.y - box.min.y + 1),
            std::size_t(box.max.z - box.min.z + 1)};
  }
  [[nodiscard]] std::size_t offset(Coord voxel) const {
    const auto [nx, ny, nz] = side();
    return (std::size_t(voxel.z - box.min.z) * ny + std::size_t(voxel.y - box.min.y)) * nx +
           std::size_t(voxel.x - box.min.x);
  }
};

/// \throws UsageError  more than maxBytes (0: no bound)
[[nodiscard]] DenseBox densify(const SparseVolume& volume, const Box& box, std::uint64_t maxBytes);

/// Voxels of the array that differ from the background by more than `activeAbove` are active; the
/// others keep their value in bricks that hold any but background.
[[nodiscard]] SparseVolume sparsify(const DenseBox& dense, float background, float activeAbove);

/// Half of the smallest difference from the background that an active voxel has; voxels that have
/// none are passed over.
[[nodiscard]] float activityThreshold(const SparseVolume& volume);

}  // namespace esvr::baselines
