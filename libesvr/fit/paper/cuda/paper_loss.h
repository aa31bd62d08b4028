#pragma once
/// The paper's loss (fit/paper_loss.h) and its derivative on the device.
///
/// Windows are summed axis by axis in shared memory, a block a brick, in float64: in a bright flat
/// region the variances that SSIM divides by are differences of squares. Every value has one writer
/// and every sum one order: the same bits in every run.

#include <array>

#include "fit/cuda/brick_table.h"
#include "fit/paper/cuda/ssim_pass.h"

namespace esvr::cuda {

/// As PaperLossInput, on the device. Pointers and tables are borrowed.
struct PaperLossArguments {
  const BrickTable& bricks;   ///< every brick where prediction or target may be non-zero
  const BrickTable& windows;  ///< around whose voxels windows lie: findAround(bricks), or a part
  const float* residual;      ///< prediction - target, kBrickVoxels a brick of the table
  const float* target;        ///< of the table's first bricks; zero in the others
  std::size_t targetBricks;   ///< how many
  double voxels, beta, peak;
};

class PaperLoss {
 public:
  explicit PaperLoss(cudaStream_t stream);

  /// \return the loss's derivative by the prediction, laid out as the residual, on the device until
  ///         the next call
  const float* derivative(const PaperLossArguments& arguments);

  /// Of the last derivative. Waits for it.
  [[nodiscard]] double loss() const;

  /// Bytes that `bricks` bricks of values take at most.
  [[nodiscard]] static double bytesFor(double bricks);

 private:
  [[nodiscard]] SsimPassArguments passArguments(const PaperLossArguments& arguments);

  cudaStream_t stream_;
  std::array<double, kSsimTaps> weights_ = ssimWeights();
  GrowingBuffer<double> byR_, windowLoss_, valueLoss_;
  GrowingBuffer<float> byRr_, byTr_, lossByValue_;
  std::size_t windowShares_ = 0, valueShares_ = 0;  ///< of the loss that the last derivative wrote
};

}  // namespace esvr::cuda
