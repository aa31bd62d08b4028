#pragma once
/// The passes over the bricks of the paper's method: residuals, and the moments of pairs for a loss
/// whose derivative by every voxel is given.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_pass.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct PaperPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;          ///< of all ellipsoids, where `kernels` is null
  const KernelConstants<float>* kernels;  ///< one for each ellipsoid, or null
  PassTarget target;
  float* residual;           ///< out: kBrickVoxels for each brick
  const float* lossByValue;  ///< laid out as the residual
  float* moments;            ///< out: kMoments for each pair
};

/// Writes residuals.
void launchPaperResiduals(const PaperPassArguments& arguments, cudaStream_t stream);
/// Writes moments, from lossByValue.
void launchPaperMoments(const PaperPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
