#pragma once
/// Divides a volume into the chunks of a fit, and the ellipsoids among them (docs/scale.md).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "esvr/volume.h"

namespace esvr {

/// Bricks that are fitted together.
struct BrickChunk {
  /// Box of brick coordinates. The boxes of all chunks fill space without overlap, so that every
  /// point lies in one of them; those at the outside are unbounded.
  Box box;
  Box bounds;                         ///< the smallest box of brick coordinates of its bricks
  std::vector<std::uint32_t> bricks;  ///< numbers of its bricks, increasing; at least one
  std::uint64_t activeVoxels = 0;
};

/// Divides bricks by planes until no chunk has more than `maxBricks`, at least 1. Each plane halves
/// the bricks across the longest side of a chunk's bounds. Time and memory of a fit are proportional
/// to the bricks, so that chunks of as many bricks cost alike.
[[nodiscard]] std::vector<BrickChunk> divideBricks(const SparseVolume& volume,
                                                   std::size_t maxBricks);

/// A box that is larger by a number of bricks on all sides, as far as coordinates reach.
[[nodiscard]] Box dilated(const Box& box, int bricks);

/// The bricks around a chunk that its fit sees, wide enough for ellipsoids of twice the distance that
/// `count` of them have if they are spread evenly over the active voxels. Supports are limited to
/// this reach, because a fit would not see the error that an ellipsoid makes beyond it.
/// \return a number of bricks on each side
[[nodiscard]] int haloBricks(std::uint64_t activeVoxels, std::size_t count);

/// Numbers of the bricks of a chunk and of its halo, increasing.
/// \param chunks  all chunks of the volume
[[nodiscard]] std::vector<std::uint32_t> bricksAround(const SparseVolume& volume,
                                                      std::span<const BrickChunk> chunks,
                                                      const BrickChunk& chunk, int halo);

/// The chunks in which a volume is fitted: those of options.chunkVoxels, or the largest ones whose
/// fits stay within the memory of the GPU and within options.maxHostBytes.
/// \return no or one chunk if the volume needs no division
[[nodiscard]] std::vector<BrickChunk> chunksFor(const SparseVolume& volume,
                                                const FitOptions& options);

/// What is known of a chunk.
struct ChunkNeed {
  double error = 0.0;     ///< sum of squares with its present ellipsoids
  double count = 0.0;     ///< its present ellipsoids, or before the fit a number in proportion
  std::size_t least = 0;  ///< smallest number of ellipsoids
  std::size_t most = 0;   ///< largest number of ellipsoids
};

/// Divides `count` so that a further ellipsoid lowers the error of every chunk by the same amount,
/// within each chunk's limits. The error of a chunk is taken to fall by kDbPerDoubling where the
/// number of its ellipsoids doubles.
/// \return a number for each chunk; together `count`, if the limits allow it
[[nodiscard]] std::vector<std::size_t> dividedCount(std::size_t count,
                                                    std::span<const ChunkNeed> needs);

}  // namespace esvr
