#pragma once
/// The two passes of the paper's loss over bricks: what every window sees, and what that means for
/// every value. paper_loss.h puts them together.

#include <cuda_runtime_api.h>

#include <array>

#include "field/ssim_window.h"
#include "fit/cuda/brick_table_view.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct SsimPassArguments {
  BrickTableView values;  ///< the bricks of prediction and target
  std::uint32_t valueCount, targetCount;
  const float* residual;   ///< prediction - target, kBrickVoxels a brick
  const float* target;     ///< of the first targetCount bricks; zero in the others
  BrickTableView windows;  ///< the bricks around whose voxels windows lie
  std::uint32_t windowCount;
  std::array<double, kSsimTaps> weights;
  SsimConstants constants;
  double absoluteScale, ssimScale;  ///< of sum |r| and of sum (1 - SSIM) in the loss
  double* byR;         ///< kBrickVoxels a window brick: WindowGradients, ssim_gradient.h
  float *byRr, *byTr;  ///< likewise
  double* windowLoss;  ///< a window brick's share of the loss
  double* valueLoss;   ///< a value brick's share
  float* lossByValue;  ///< out, laid out as the residual
};

/// Fills byR, byRr, byTr and windowLoss. \throws DeviceError  too little shared memory
void launchWindowSide(const SsimPassArguments& arguments, cudaStream_t stream);
/// Fills lossByValue and valueLoss; wants launchWindowSide before, unless ssimScale is 0.
void launchValueSide(const SsimPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
