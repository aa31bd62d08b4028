#pragma once
/// The passes of the paper's method over the bricks. One computes residuals; the other computes the
/// moments of pairs from the derivative of a loss by every voxel.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_pass.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct PaperPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;          ///< kernel of all ellipsoids, if `kernels` is null
  const KernelConstants<float>* kernels;  ///< a kernel for each ellipsoid, or null
  PassTarget target;
  float* residual;           ///< output: kBrickVoxels values for each brick
  const float* lossByValue;  ///< input of the moments, in the layout of the residual
  float* moments;            ///< output: kMoments values for each pair
};

/// Writes the residuals.
void launchPaperResiduals(const PaperPassArguments& arguments, cudaStream_t stream);
/// Writes the moments for the given lossByValue.
void launchPaperMoments(const PaperPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
