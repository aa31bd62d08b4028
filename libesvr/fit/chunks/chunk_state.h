#pragma once
/// The state of a fit in chunks between two rounds.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/chunks/chunk_target.h"
#include "fit/optimiser.h"

namespace esvr {

/// The fit of one chunk after a round.
struct ChunkState {
  FitState fit;                ///< the ellipsoids whose centers are in the chunk's box
  std::size_t firstCount = 0;  ///< ellipsoids at the start of growth
  std::size_t wanted = 0;      ///< ellipsoids at the end of growth
  FitErrors errors;            ///< errors of its part of the box when it was last fitted
  std::uint64_t pairs = 0;     ///< pairs of the ellipsoids in the chunk and its halo, and bricks

  [[nodiscard]] std::size_t count() const { return fit.ellipsoids.size(); }
};

/// Sum of squares over a chunk's active voxels if nothing is fitted.
[[nodiscard]] double energyOf(const ChunkScene& scene, const BrickChunk& chunk);

/// Drops the faintest ellipsoids beyond `most`. A chunk may end a round with a few more ellipsoids
/// than it should, because those in its halo may move or be relocated into it.
void dropSurplus(std::size_t most, std::vector<ChunkState>& states);

}  // namespace esvr
