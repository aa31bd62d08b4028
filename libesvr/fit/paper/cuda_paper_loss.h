#pragma once
/// The paper's loss (fit/paper/paper_loss.h) and its derivative on the device.
///
/// A block of threads sums the windows of a brick axis by axis in shared memory. It computes in
/// float64, because the variances of SSIM are small differences of large squares in a bright flat
/// region. Every value has one writer and every sum has one order, so the result has the same bits
/// in every run.

#include <cuda_runtime_api.h>

#include <array>

#include "field/ssim_window.h"
#include "fit/cuda/lists.h"

namespace esvr::cuda {

struct SsimPassArguments;

/// PaperLossInput on the device. The caller owns all pointers and tables.
struct PaperLossArguments {
  const BrickTable& bricks;   ///< every brick where prediction or target may be non-zero
  const BrickTable& windows;  ///< bricks whose voxels have windows: findAround(bricks) or a part
  const float* residual;      ///< prediction - target, kBrickVoxels values for each brick
  const float* target;        ///< target in the table's first bricks; it is zero in others
  std::size_t targetBricks;   ///< number of these first bricks
  double voxels, beta, peak;
};

class PaperLoss {
 public:
  explicit PaperLoss(cudaStream_t stream);

  /// \return the derivative of the loss by the prediction, in device memory and in the layout of
  ///         the residual; valid until the next call
  const float* derivative(const PaperLossArguments& arguments);

  /// The loss at the last call of derivative(), for which it waits.
  [[nodiscard]] double loss() const;

  /// Estimate of the device memory for this number of bricks of values, bytes.
  [[nodiscard]] static double bytesFor(double bricks);

 private:
  [[nodiscard]] SsimPassArguments passArguments(const PaperLossArguments& arguments);

  cudaStream_t stream_;
  std::array<double, kSsimTaps> weights_ = ssimWeights();
  GrowingBuffer<double> byR_, windowLoss_, valueLoss_;
  GrowingBuffer<float> byRr_, byTr_, lossByValue_;
  std::size_t windowShares_ = 0, valueShares_ = 0;  ///< number of partial losses of the last call
};

}  // namespace esvr::cuda
