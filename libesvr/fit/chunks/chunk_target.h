#pragma once
/// The target of one chunk's fit.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/kernel.h"
#include "fit/chunks/divide_bricks.h"
#include "fit/ellipsoid.h"
#include "fit/target.h"

namespace esvr {

/// The bricks around a chunk that its fit sees, wide enough for ellipsoids of twice the distance that
/// `count` of them have if they are spread evenly over the active voxels. Supports are limited to
/// this reach, because a fit would not see the error that an ellipsoid makes beyond it.
/// \return a number of bricks on each side
[[nodiscard]] int haloBricks(std::uint64_t activeVoxels, std::size_t count);

/// A volume that is fitted in chunks.
struct ChunkScene {
  const SparseVolume& volume;
  std::span<const BrickChunk> chunks;
  TargetScale scale;  ///< the units and the range of the whole volume, which all chunks share
  Box box;            ///< box of the PSNR, relative to the volume's origin
  int halo;           ///< see haloBricks()
};

/// The bricks of a chunk and of its halo, and the target that consists of them. It is pinned,
/// because the target points to its other members.
struct ChunkTarget {
  ChunkTarget() = default;
  ChunkTarget(const ChunkTarget&) = delete;
  ChunkTarget& operator=(const ChunkTarget&) = delete;

  std::vector<BrickMask> counted;  ///< active voxels of the chunk's bricks; none of the halo's
  FitTarget target;
};

/// Numbers of the bricks of a chunk and of its halo, increasing.
/// \param chunks  all chunks of the volume
[[nodiscard]] std::vector<std::uint32_t> bricksAround(const SparseVolume& volume,
                                                      std::span<const BrickChunk> chunks,
                                                      const BrickChunk& chunk, int halo);

/// Ellipsoids that are not fitted but take part in the sum.
struct Ghosts {
  std::span<const Ellipsoid> ellipsoids;  ///< relative to the volume's origin, in its scaled units
  Kernel kernel;
};

/// The chunk's part of the box of the PSNR.
[[nodiscard]] Box boxOf(const ChunkScene& scene, const BrickChunk& chunk);

/// Makes the target of a chunk. Its PSNR counts the chunk's own part of the box.
void makeChunkTarget(const ChunkScene& scene, const BrickChunk& chunk, const Ghosts& ghosts,
                     ChunkTarget& out);

}  // namespace esvr
