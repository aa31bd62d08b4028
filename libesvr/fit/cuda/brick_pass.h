#pragma once
/// One pass over the bricks: residuals, loss, and the moments of pairs.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_table_view.h"
#include "fit/cuda/pair_form.h"
#include "fit/cuda/pair_lists.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct BrickPassArguments {
  const Coord* bricks;
  std::uint32_t brickCount, targetCount;
  PairListsView lists;
  const PairForm* forms;  ///< an ellipsoid's
  KernelConstants<float> kernel;
  const float* target;    ///< kBrickVoxels a target brick
  bool narrowBand;        ///< residuals saturate at the target's range
  float lowest, highest;  ///< that range
  double* brickLoss;      ///< out, a brick's: sum of r^2
  float* moments;         ///< out, kMoments a pair; not written for residuals alone
  float* residual;        ///< kBrickVoxels a brick; out, or null
  const KernelConstants<float>* kernels = nullptr;  ///< an ellipsoid's; null: all have `kernel`
  const float* lossByValue = nullptr;  ///< kBrickVoxels a brick, for launchGivenGradients
};

/// Values of a pair in `moments`: PairMoments, in its order.
inline constexpr int kMoments = 12;

/// Loss and moments for gradients of 1/2 sum r^2. \param threads  ThreadsPerBrick::threads of a
/// choice
void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream);
/// Moments for gradients of a loss whose derivative by V is given. Writes no loss.
void launchGivenGradients(const BrickPassArguments& arguments, cudaStream_t stream);
/// Loss and residuals.
void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
