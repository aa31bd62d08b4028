#pragma once
/// The optimiser of the paper's method on a GPU.

#include <memory>
#include <vector>

#include "core/cuda/memory_pool.h"
#include "core/cuda/stream.h"
#include "fit/cuda/brick_table.h"
#include "fit/cuda/error_sums.h"
#include "fit/cuda/pair_lists.h"
#include "fit/paper/cuda/paper_loss.h"
#include "fit/paper/cuda/paper_pass.h"
#include "fit/paper/cuda/paper_step.h"
#include "fit/paper/paper_optimiser.h"

namespace esvr::cuda {

class CudaPaperOptimiser final : public paper::PaperOptimiser {
 public:
  /// The device of the options must be the current one.
  CudaPaperOptimiser(const FitTarget& target, const paper::PaperOptions& options);

  [[nodiscard]] std::size_t subvolumeCount() const override { return parts_.size(); }
  void iterate(std::size_t subvolume, const paper::PaperStep& step) override;
  [[nodiscard]] paper::LossGradients gradients(std::size_t subvolume) override;
  void put(const paper::Population& population) override;
  [[nodiscard]] paper::Population population() const override;
  [[nodiscard]] std::size_t ellipsoidCount() const override { return count_; }
  [[nodiscard]] FitErrors measure() override;
  [[nodiscard]] std::uint64_t pairCount() const override { return pairCount_; }
  [[nodiscard]] std::size_t deviceBytes() const override;

 private:
  /// A subvolume and its data on the device.
  struct Part {
    Part(std::unique_ptr<paper::Subvolume> from, bool visitOnly, cudaStream_t stream);

    std::unique_ptr<paper::Subvolume> volume;
    DeviceBuffer<float> values;  ///< values of the target; empty if they are uploaded on each visit
    BrickTable bricks, windows;
    PairLists lists;
    double motionLeft = -1.0;  ///< voxels by which supports may still move; < 0: lists are outdated
  };

  void requireMemoryFor(std::size_t ellipsoids) const;
  void rebuildLists(Part& part, double slack);
  void bring(const Part& part);
  void takeGradients(Part& part);
  void takeResiduals(Part& part);
  [[nodiscard]] PaperEllipsoids ellipsoids();
  [[nodiscard]] PaperPassArguments passArguments(const Part& part);
  [[nodiscard]] MomentSums momentSums(const Part& part);

  const FitTarget& target_;
  paper::PaperOptions options_;
  Kernel kernel_;
  KernelConstants<double> constants_;
  MemoryShare memory_;  ///< what the buffers below take
  KeepFreedMemory keep_;
  Stream stream_;
  std::vector<std::unique_ptr<Part>> parts_;
  GrowingBuffer<paper::PaperEllipsoid> ellipsoids_;
  GrowingBuffer<paper::PaperState> states_;
  GrowingBuffer<Ellipsoid> units_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<KernelConstants<float>> kernels_;
  GrowingBuffer<double> radii_;
  GrowingBuffer<float> moments_, residual_, visited_;
  GrowingBuffer<BrickMask> active_;
  const float* values_ = nullptr;  ///< target's values of the visited subvolume
  GrowingBuffer<double> chunkSums_;
  DeviceBuffer<int> diverged_;
  ErrorSums errorSums_;
  PaperLoss loss_;
  std::size_t count_ = 0;
  std::uint64_t pairCount_ = 0;
};

}  // namespace esvr::cuda
