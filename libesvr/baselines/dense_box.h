#pragma once
/// The voxels of a box as an array, for compressors of dense data.

#include <array>
#include <cstdint>
#include <vector>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"

namespace esvr::baselines {

/// An array of values with x fastest, as in ZFP, SZ and raw image files.
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

/// Copies the voxels of a box to an array.
/// \throws UsageError  the array takes more than maxBytes (0: no limit)
[[nodiscard]] DenseBox densify(const SparseVolume& volume, const Box& box, std::uint64_t maxBytes);

/// Makes a volume from an array. Voxels that differ from the background by more than `activeAbove`
/// are active; other voxels keep their values. Bricks of background only are left out.
[[nodiscard]] SparseVolume sparsify(const DenseBox& dense, float background, float activeAbove);

/// Half of the smallest difference between an active voxel and the background. Active voxels that
/// equal the background are ignored.
[[nodiscard]] float activityThreshold(const SparseVolume& volume);

}  // namespace esvr::baselines
