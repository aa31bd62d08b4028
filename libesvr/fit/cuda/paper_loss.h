#pragma once
/// The paper's loss (fit/paper_loss.h) and its derivative on the device.
///
/// Windows are summed axis by axis in shared memory, a block a brick, in float64: in a bright flat
/// region the variances that SSIM divides by are differences of squares. Every value has one writer
/// and every sum one order: the same bits in every run.

#include <array>

#include "fit/cuda/brick_table.h"
#include "fit/cuda/ssim_pass.h"

namespace esvr::cuda {

/// As PaperLossInput, on the device. Pointers are borrowed.
struct PaperLossArguments {
  const float* residual;     ///< prediction - target, kBrickVoxels a brick of the table
  const float* target;       ///< of the table's first bricks; zero in the others
  std::size_t targetBricks;  ///< how many
  double voxels, beta, peak;
};

class PaperLoss {
 public:
  explicit PaperLoss(cudaStream_t stream);

  /// To be called whenever bricks come or go. The table must stay until the next call.
  /// \param within  in bricks: only the windows of its voxels count
  void setBricks(const BrickTable& bricks, const Box& within = kAllBricks);

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
  const BrickTable* bricks_ = nullptr;
  BrickTable windows_;
  GrowingBuffer<double> byR_, windowLoss_, valueLoss_;
  GrowingBuffer<float> byRr_, byTr_, lossByValue_;
  std::size_t windowShares_ = 0;  ///< of windowLoss_ that the last derivative wrote
};

}  // namespace esvr::cuda
