#pragma once
/// Draws the bricks of several grids in one picture on a CUDA device. Rays wait for missing bricks as
/// in brick_draw.h.

#include "render/cuda/brick_demand.h"
#include "render/cuda/waiting_tiles.h"
#include "render/grids_march.h"

namespace esvr::cuda {

struct GridsDrawArguments {
  GridsScene scene;  ///< tables are on the device
  int grids;         ///< 1 to kMostGrids
  BrickSlotsView slots[kMostGrids];
  TileBand band;
  BrickDemand demand[kMostGrids];  ///< without slotOf: no brick of the grid can be missing
  int ahead;  ///< missing bricks that a ray asks for besides those at which it waits
  std::uint32_t* waitingCount;  ///< null: no brick can be missing
  std::uint32_t* waiting;       ///< output: numbers of the tiles or entries that wait
};

/// As launchMarch() for one grid.
void launchMarch(const GridsDrawArguments& arguments, const WaitingTiles<KeptGridsRay>& tiles,
                 cudaStream_t stream);

}  // namespace esvr::cuda
