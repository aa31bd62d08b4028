#pragma once
/// The tiles of a band of a picture that is marched on a CUDA device, and the samples in which their
/// rays may meet bricks.

#include <cuda_runtime_api.h>

#include "render/brick_cover.h"
#include "render/brick_march.h"

namespace esvr::cuda {

inline constexpr int kMarchTileSide = 8;  ///< pixels
inline constexpr int kMarchTilePixels = kMarchTileSide * kMarchTileSide;

/// All pointers are to device memory.
struct TileBand {
  Resolution resolution;       ///< of the picture
  int firstTileRow, tileRows;  ///< rows of tiles in this band of the picture
  int2* ranges;                ///< for each tile: first and last sample, counted from firstSample
  double firstSample;          ///< the first sample, counted from the eye
  float4* pixels;              ///< pixels of the band; must be zero before

  [[nodiscard]] ESVR_HD static int tilesAlong(int pixels) {
    return (pixels + kMarchTileSide - 1) / kMarchTileSide;
  }
  [[nodiscard]] ESVR_HD int tiles() const { return tilesAlong(resolution.width) * tileRows; }
};

/// Bricks that rays may meet.
struct CoveringBricks {
  View view;                   ///< relative to the origin of the bricks
  double step;                 ///< distance of samples, in the voxels of the bricks
  const Coord* bricks;         ///< places relative to the table's origin
  std::uint32_t first, count;  ///< number of the first of them, and how many there are
  /// Bricks that are vacant here do not count; null: all count.
  const std::uint32_t* slotOf;
};

/// Sets the ranges of all tiles to none.
void launchClearRanges(const TileBand& band, cudaStream_t stream);
/// Widens the ranges of all tiles by the samples in which their rays may meet the bricks.
void launchWidenRanges(const TileBand& band, const CoveringBricks& bricks, cudaStream_t stream);

}  // namespace esvr::cuda
