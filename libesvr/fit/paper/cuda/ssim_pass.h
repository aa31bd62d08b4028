#pragma once
/// The two passes of the paper's loss over the bricks. The first evaluates all windows, the second
/// the derivatives by all values (fit/paper/ssim_gradient.h). paper_loss.h calls both.

#include <cuda_runtime_api.h>

#include <array>

#include "field/ssim_window.h"
#include "fit/cuda/brick_table_view.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct SsimPassArguments {
  BrickTableView values;  ///< the bricks of prediction and target
  std::uint32_t valueCount, targetCount;
  const float* residual;   ///< prediction - target, kBrickVoxels values for each brick
  const float* target;     ///< target in the first targetCount bricks; it is zero in others
  BrickTableView windows;  ///< the bricks whose voxels have windows around them
  std::uint32_t windowCount;
  std::array<double, kSsimTaps> weights;
  SsimConstants constants;
  double absoluteScale, ssimScale;  ///< factors of sum |r| and sum (1 - SSIM) in the loss
  double* byR;         ///< kBrickVoxels values for each brick of windows: WindowGradients::byR
  float *byRr, *byTr;  ///< WindowGradients::byRr and byTr, in the same layout
  double* windowLoss;  ///< output: share of each brick of windows in the loss
  double* valueLoss;   ///< output: share of each brick of values in the loss
  float* lossByValue;  ///< output, in the layout of the residual
};

/// Fills byR, byRr, byTr and windowLoss.
/// \throws DeviceError  the device has too little shared memory
void launchWindowSide(const SsimPassArguments& arguments, cudaStream_t stream);
/// Fills lossByValue and valueLoss. launchWindowSide must have been called before, unless ssimScale
/// is 0.
void launchValueSide(const SsimPassArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
