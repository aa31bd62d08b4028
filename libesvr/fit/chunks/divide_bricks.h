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

/// Divides bricks by planes until no chunk has more than `maxBricks`, at least 1. Each plane halves
/// the bricks across the longest side of a chunk's bounds. Time and memory of a fit are proportional
/// to the bricks, so that chunks of as many bricks cost alike.
[[nodiscard]] std::vector<BrickChunk> divideBricks(const SparseVolume& volume,
                                                   std::size_t maxBricks);

/// A box that is larger by a number of bricks on all sides, as far as coordinates reach.
[[nodiscard]] Box dilated(const Box& box, int bricks);

}  // namespace esvr
