#pragma once
/// Passes over the bricks for a solve of intensities: sums, what a reader makes of them, and back
/// to the ellipsoids.

#include <cuda_runtime_api.h>

#include "field/brick_kernels.h"
#include "field/voxel_rule.h"
#include "fit/cuda/pass_scene.h"
#include "fit/intensity_passes.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct IntensityPassArguments {
  /// Words of a brick in `exact`: their bit v says that voxel v was stored exactly.
  static constexpr std::uint32_t kMaskWords = kBrickVoxels / 32;

  PassScene scene;       ///< its forms have no intensity
  const float* heights;  ///< one for each ellipsoid, instead of it
  KernelConstants<float> kernel;
  const float* source;  ///< kBrickVoxels a target brick
  float sourceBackground, fieldBackground;
  VoxelRule stored;
  Box box;                      ///< of errors, in the bricks' frame
  StoredError* errors;          ///< out, a brick's
  std::uint32_t* exact;         ///< kMaskWords a brick
  PairProjection* projections;  ///< out, a pair's
};

/// Writes errors.
void launchStoredErrors(const IntensityPassArguments& arguments, cudaStream_t stream);
/// Writes errors, exact voxels, and projections of residuals.
void launchIntensityGradient(const IntensityPassArguments& arguments, cudaStream_t stream);
/// Writes projections of the sum, less its exact voxels.
void launchNormalProduct(const IntensityPassArguments& arguments, cudaStream_t stream);

/// Sums of the projections of each ellipsoid's pairs, in one order.
struct ProjectionSums {
  const PairProjection* projections;
  const std::uint32_t* ellipsoidBegin;
  std::uint32_t ellipsoidCount;
  double *rPhi, *phi2;  ///< out, an ellipsoid's; null: not wanted
};
void launchProjectionSums(const ProjectionSums& sums, cudaStream_t stream);

}  // namespace esvr::cuda
