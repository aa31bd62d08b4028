#pragma once
/// Divides the bricks of a volume into the chunks of a fit.

#include <cstdint>
#include <span>
#include <vector>

#include "esvr/sparse_volume.h"

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

/// Divides bricks by planes until no chunk has more than `maxVoxels` active voxels or it is a single
/// brick. Each plane halves the active voxels across the longest side of a chunk's bounds.
[[nodiscard]] std::vector<BrickChunk> divideBricks(const SparseVolume& volume,
                                                   std::uint64_t maxVoxels);

/// A box that is larger by a number of bricks on all sides, as far as coordinates reach.
[[nodiscard]] Box dilated(const Box& box, int bricks);

}  // namespace esvr
