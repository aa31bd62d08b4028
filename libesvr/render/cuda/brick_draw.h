#pragma once
/// Draws a brick atlas on a CUDA device. A first kernel finds, for each tile of pixels, the range
/// of samples in which its rays may meet bricks. A second one marches the rays through that range.

#include <cuda_runtime_api.h>

#include <cstdint>

#include "render/brick_march.h"

namespace esvr::cuda {

inline constexpr int kMarchTileSide = 8;  ///< pixels

struct BrickDrawArguments {
  BrickAtlasView atlas;  ///< on the device
  const Coord* bricks;   ///< positions relative to the atlas, in bricks
  std::uint32_t count;
  MarchScene scene;  ///< in coordinates relative to the atlas
  Resolution resolution;
  int firstTileRow, tileRows;  ///< rows of tiles in this band of the picture
  int2* ranges;                ///< for each tile: first and last sample, counted from firstSample
  double firstSample;          ///< the scene's first sample, counted from the eye
  float4* pixels;              ///< pixels of the band; must be zero before
};

void launchBricks(const BrickDrawArguments& arguments, int multiprocessors, cudaStream_t stream);

}  // namespace esvr::cuda
