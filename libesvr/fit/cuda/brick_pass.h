#pragma once
/// A pass over the bricks. It computes the residuals, their squares, and the moments of the pairs.

#include <cuda_runtime_api.h>

#include "fit/cuda/pass_scene.h"

namespace esvr::cuda {

/// The values that the sum is compared with.
struct PassTarget {
  const float* values;     ///< kBrickVoxels values for each of the first `bricks` bricks
  const float* constants;  ///< values that are added to the sums of these bricks; null: none
  std::uint32_t bricks;    ///< bricks that have values; the values of all others are 0
  bool saturates;          ///< the sum is clamped to [lowest, highest] before it is compared
  float lowest, highest;   ///< range of the target
};

/// All pointers are to device memory that the caller owns.
struct BrickPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;
  PassTarget target;
  double* brickLoss;  ///< output: sum of r^2 of each brick
  float* moments;     ///< output of launchGradients: kMoments values for each pair
  float* residual;    ///< output: kBrickVoxels values for each brick; null: not wanted
  const int* halted;  ///< flag of isHalted()
};

/// Number of moments of a pair. They are stored in the order of PairMoments.
inline constexpr int kMoments = 12;

/// Writes the loss, and the moments for the gradients of 1/2 sum r^2.
/// \param threads  threads for each brick, one of ThreadsPerBrick::threads()
void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream);
/// Writes the loss and the residuals.
void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
