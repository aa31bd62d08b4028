#pragma once
/// New ellipsoids at drawn voxels.

#include <cuda_runtime_api.h>

#include "fit/adam.h"
#include "fit/cuda/brick_table_view.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct SeedArguments {
  const Coord* voxels;  ///< drawn
  std::uint32_t count;
  BrickTableView bricks;
  const float* residual;      ///< kBrickVoxels a brick
  int window;                 ///< half width of the neighbourhood that shapes a seed, voxels
  double unitVariance;        ///< of the kernel
  double intensity;           ///< of the residual at the seed
  double share;               ///< energy that each draw stood for
  const std::uint32_t* into;  ///< places of the new ellipsoids; null: firstPlace and on
  std::uint32_t firstPlace;
  Ellipsoid* ellipsoids;
  AdamState* states;
};

void launchPlaceSeeds(const SeedArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
