#pragma once
/// Draws bricks of cells on a CUDA device. A first kernel finds, for each tile of pixels, the range
/// of samples in which its rays may meet bricks. A second one marches the rays through that range.
/// Rays that meet a missing brick ask for it and wait; they continue in later passes.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "render/level_march.h"

namespace esvr::cuda {

inline constexpr int kMarchTileSide = 8;  ///< pixels
inline constexpr int kMarchTilePixels = kMarchTileSide * kMarchTileSide;

/// The bricks that rays ask for. All pointers are to device memory.
struct BrickDemand {
  struct Counts {
    std::uint32_t bricks;   ///< bricks that are asked for
    std::uint32_t waiting;  ///< tiles with rays that wait
    std::uint32_t free;     ///< free slots
    std::uint32_t spare;    ///< slots that became free while bricks are decoded
  };
  Counts* counts;
  std::uint32_t* slotOf;  ///< see BrickSlotsView; null: no brick can be missing
  std::uint32_t* bricks;  ///< output: bricks that are asked for; room for all
  std::uint32_t* stamps;  ///< output: `now`, for each slot that a ray reads; null: not wanted
  std::uint32_t now;
  int ahead;  ///< missing bricks that a ray asks for besides the one at which it waits
};

/// The tiles of a band whose rays wait, and how far these are.
struct WaitingTiles {
  std::uint32_t count = 0;
  bool begin = false;                      ///< the entries are all tiles, and their rays begin now
  const std::uint32_t* entries = nullptr;  ///< numbers in `tiles` and `rays`
  const std::uint32_t* tiles = nullptr;    ///< by entry: number of the tile
  RayProgress* rays = nullptr;  ///< by entry: kMarchTilePixels rays; next < 0: the ray has ended
};

struct BrickDrawArguments {
  LevelScene scene;  ///< tables are on the device
  BrickSlotsView slots;
  /// Bricks of the coarsest level of the scene: places relative to the table's origin. Tiles find
  /// their ranges among them.
  const Coord* bricks;
  std::uint32_t firstBrick, count;  ///< number of the first of them, and how many there are
  Resolution resolution;
  int firstTileRow, tileRows;  ///< rows of tiles in this band of the picture
  int2* ranges;                ///< for each tile: first and last sample, counted from firstSample
  double firstSample;          ///< the first sample, counted from the eye in the coarsest level
  float4* pixels;              ///< pixels of the band; must be zero before
  BrickDemand demand;
  std::uint32_t* waiting;  ///< output: numbers of the tiles or entries that wait
};

/// Finds the ranges of all tiles.
void launchRanges(const BrickDrawArguments& arguments, cudaStream_t stream);
/// Marches the rays that wait. \param tiles  if there are none, the rays of the whole band are
/// marched from their first samples, and rays that must wait are not kept
void launchMarch(const BrickDrawArguments& arguments, const WaitingTiles& tiles,
                 cudaStream_t stream);

}  // namespace esvr::cuda
