#pragma once
/// Makes new ellipsoids at sampled voxels.

#include <cuda_runtime_api.h>

#include "fit/adam.h"
#include "fit/cuda/brick_table_view.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct SeedArguments {
  const Coord* voxels;  ///< sampled voxels
  std::uint32_t count;
  BrickTableView bricks;
  const float* residual;      ///< kBrickVoxels values for each brick
  int window;                 ///< half width of the window that shapes a seed, voxels
  double unitVariance;        ///< variance of the kernel
  double intensity;           ///< intensity of a seed, relative to the residual
  double share;               ///< energy for each draw
  const std::uint32_t* into;  ///< places of the seeds; null: firstPlace and those after it
  std::uint32_t firstPlace;
  Ellipsoid* ellipsoids;
  AdamState* states;
};

void launchPlaceSeeds(const SeedArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
