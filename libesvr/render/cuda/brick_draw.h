#pragma once
/// Draws bricks of cells on a CUDA device. Each ray is marched through the range of samples in which
/// the rays of its tile may meet bricks. Rays that meet a missing brick ask for it and wait; they
/// continue in later passes.

#include "render/cuda/brick_demand.h"
#include "render/cuda/waiting_tiles.h"
#include "render/level_march.h"

namespace esvr::cuda {

struct BrickDrawArguments {
  LevelScene scene;  ///< tables are on the device
  BrickSlotsView slots;
  TileBand band;  ///< its samples are those of the coarsest level
  BrickDemand demand;
  std::uint32_t* waiting;  ///< output: numbers of the tiles or entries that wait
};

/// Marches the rays that wait. \param tiles  if there are none, the rays of the whole band are
/// marched from their first samples, and rays that must wait are not kept
void launchMarch(const BrickDrawArguments& arguments, const WaitingTiles<KeptRay>& tiles,
                 cudaStream_t stream);

}  // namespace esvr::cuda
