#pragma once
/// One pass over the bricks: residuals, their squares, and the moments of pairs.

#include <cuda_runtime_api.h>

#include "fit/cuda/pass_scene.h"

namespace esvr::cuda {

/// The values that sums are compared with.
struct PassTarget {
  const float* values;    ///< kBrickVoxels for each target brick, in device memory
  bool narrowBand;        ///< residuals saturate at the target's range
  float lowest, highest;  ///< that range
};

/// Pointers are to device memory, borrowed.
struct BrickPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;
  PassTarget target;
  double* brickLoss;  ///< out: a brick's sum of r^2
  float* moments;     ///< out: kMoments for each pair; not written for residuals alone
  float* residual;    ///< out: kBrickVoxels for each brick; null where they are not wanted
  const int* halted;  ///< isHalted()
};

/// Values of a pair in `moments`: PairMoments, in its order.
inline constexpr int kMoments = 12;

/// Loss and moments for gradients of 1/2 sum r^2. \param threads  ThreadsPerBrick::threads of a
/// choice
void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream);
/// Loss and residuals.
void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
