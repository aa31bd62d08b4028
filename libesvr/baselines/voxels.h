#pragma once
/// What baselines make of the voxels of a volume: fewer voxels, for VDB files that drop those near the
/// background, and arrays, for compressors of dense data.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/vdb_io.h"
#include "esvr/volume.h"

namespace esvr::baselines {

// Voxels near the background

/// The distinct deviations of the active voxels from the background, increasing: |value - background|,
/// or, in a level set, the distance from the band's edge, |background| - |value|. Thresholds between
/// two of them have the same effect.
[[nodiscard]] std::vector<float> thresholds(const VolumeGrid& grid);

/// Drops the active voxels that deviate by `threshold` or less: they become inactive and hold the
/// background (in a level set, with their sign). Bricks without an active voxel are removed.
[[nodiscard]] VolumeGrid withoutVoxels(const VolumeGrid& grid, double threshold);

// The box of a volume as an array

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

// The bricks of a volume as one array, where its box does not fit into memory

/// The arrangement of bricks in a stack: brick b is at (0, b / length, b % length). ZFP allows
/// 65,536 voxels along an axis, which is why there may be several rows.
struct StackShape {
  std::size_t rows = 1, length = 0;

  [[nodiscard]] Box box() const;  ///< the voxels of the stack
};
[[nodiscard]] StackShape stackShape(std::size_t bricks);

/// The bricks of a volume side by side. An array of them has hardly any empty space, and blocks of
/// 4^3 voxels do not cross their borders.
[[nodiscard]] SparseVolume stackBricks(const SparseVolume& volume);

/// The inverse of stackBricks.
/// \param bricks  positions of all bricks, of which `stack` may lack some
[[nodiscard]] SparseVolume unstackBricks(const SparseVolume& stack, std::span<const Coord> bricks,
                                         Coord origin);

/// Brick positions as bytes, one byte for a brick that follows another one along z.
/// \param bricks  in increasing order, each >= 0
[[nodiscard]] std::vector<std::byte> encodeBricks(std::span<const Coord> bricks);

/// Decodes brick positions. `bytes` then begins behind them.
/// \throws BadInput  the bytes end too early
[[nodiscard]] std::vector<Coord> decodeBricks(std::span<const std::byte>& bytes);

}  // namespace esvr::baselines
