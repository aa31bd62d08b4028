#pragma once
/// Starts the marching of a brick atlas on a CUDA device: first each tile of pixels learns between
/// which samples its rays may meet bricks, then its rays are marched there.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "render/brick_march.h"

namespace esvr::cuda {

inline constexpr int kMarchTileSide = 8;  ///< pixels

struct BrickDrawArguments {
  BrickAtlasView atlas;  ///< on the device
  const Coord* bricks;   ///< relative to the atlas, in bricks
  std::uint32_t count;
  MarchScene scene;  ///< relative to the atlas
  Resolution resolution;
  int firstTileRow, tileRows;  ///< the band's
  int2* ranges;                ///< tiles: first and last sample, counted from `firstSample`
  double firstSample;          ///< the scene's
  float4* pixels;              ///< the band's, zero before
};

void launchBricks(const BrickDrawArguments& arguments, int multiprocessors, cudaStream_t stream);

}  // namespace esvr::cuda
