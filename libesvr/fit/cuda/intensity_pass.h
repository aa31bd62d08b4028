#pragma once
/// Passes over the bricks that a solve for the intensities needs: from intensities to sums and to
/// the values that a reader gets, and from residuals back to the ellipsoids.

#include <cuda_runtime_api.h>

#include "field/brick_kernels.h"
#include "field/voxel_rule.h"
#include "fit/cuda/pass_scene.h"
#include "fit/intensity_passes.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct IntensityPassArguments {
  /// Number of words for each brick in `exact`. Bit v is set if a reader gets voxel v exactly.
  static constexpr std::uint32_t kMaskWords = kBrickVoxels / 32;

  PassScene scene;       ///< the intensities of its forms are not used
  const float* heights;  ///< intensity of each ellipsoid
  KernelConstants<float> kernel;
  const float* source;  ///< kBrickVoxels values for each target brick
  float sourceBackground, fieldBackground;
  VoxelRule stored;
  Box box;                      ///< voxels whose errors count, in the bricks' frame
  StoredError* errors;          ///< output: error of each brick
  std::uint32_t* exact;         ///< kMaskWords words for each brick
  PairProjection* projections;  ///< output: projection of each pair
};

/// Writes errors.
void launchStoredErrors(const IntensityPassArguments& arguments, cudaStream_t stream);
/// Writes errors, exact voxels, and projections of residuals.
void launchIntensityGradient(const IntensityPassArguments& arguments, cudaStream_t stream);
/// Writes projections of the sum, without the voxels that were stored exactly.
void launchNormalProduct(const IntensityPassArguments& arguments, cudaStream_t stream);

/// The sums of the projections of each ellipsoid's pairs, always in the same order.
struct ProjectionSums {
  const PairProjection* projections;
  const std::uint32_t* ellipsoidBegin;
  std::uint32_t ellipsoidCount;
  double *rPhi, *phi2;  ///< output: sums of each ellipsoid; null: not wanted
};
void launchProjectionSums(const ProjectionSums& sums, cudaStream_t stream);

}  // namespace esvr::cuda
