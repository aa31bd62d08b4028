#pragma once
/// The optimiser on a GPU. It decides the order of the operations; their kernels are in the other
/// files of this folder.

#include <optional>
#include <span>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "fit/cuda/brick_pass.h"
#include "fit/cuda/lists.h"
#include "fit/cuda/relocation.h"
#include "fit/cuda/step.h"
#include "fit/optimiser.h"

namespace esvr::cuda {

class CudaOptimiser final : public Optimiser {
 public:
  /// The device of the options must be the current one.
  CudaOptimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning);

  void setState(const FitState& state) override;
  [[nodiscard]] FitState state() const override;
  void setEllipsoids(std::span<const Ellipsoid> ellipsoids) override;
  void growTo(std::size_t count) override;
  void relocate(std::size_t count) override;
  double iterate(std::span<const double> factors) override;
  [[nodiscard]] std::uint32_t batchSize() const override { return StepStatus::kMaxAhead; }
  [[nodiscard]] FitErrors measure() override;
  void dropUnseen() override;
  [[nodiscard]] const Kernel& kernel() const override { return options_.kernel; }
  [[nodiscard]] double kappaSlope() override;
  void setKappa(float kappa) override;

  [[nodiscard]] std::size_t ellipsoidCount() const override { return count_; }
  [[nodiscard]] std::vector<Ellipsoid> ellipsoids() const override;
  [[nodiscard]] std::uint64_t pairCount() const override { return lists_.pairCount(); }
  [[nodiscard]] std::size_t deviceBytes() const override;
  [[nodiscard]] bool deviceFull() const override { return full_; }
  [[nodiscard]] double secondsSeeding() const override { return secondsSeeding_; }

  /// The gradients of 1/2 sum r^2 for the current ellipsoids.
  /// \param threads  threads for each brick, which do not change the result
  [[nodiscard]] std::vector<EllipsoidGradient> gradients(int threads = ThreadsPerBrick::threads(1));

 private:
  void setKernel();
  void writeForms();
  void buildLists(const SupportSource& supports);
  void rebuildLists();
  void buildTightLists();
  void writeResiduals();
  void step(double factor, std::size_t n);
  [[nodiscard]] std::size_t look(std::size_t started);
  void sumLoss();
  void reserve(std::size_t ellipsoids);
  void grow(std::size_t count);

  void releaseScratch();
  void keep(std::span<const std::size_t> places);
  void dropLeastUseful();
  template <class Work>
  auto withRoom(const Work& work);
  template <class Work>
  auto withFewer(const Work& work);
  /// Places seeds. \return their number, which is below `count` if few voxels have an error
  std::size_t placeSeeds(std::size_t count, std::size_t ellipsoids, const std::uint32_t* into);
  [[nodiscard]] BrickPassArguments passArguments();
  [[nodiscard]] MomentSums momentSums();
  [[nodiscard]] StepArguments stepArguments(double factor, std::size_t n);

  const FitTarget& target_;
  OptimiserOptions options_;
  Tuning tuning_;
  KernelConstants<double> kernel_;
  double radius_;
  double unitVariance_;
  MemoryShare memory_;  ///< what the buffers below take
  KeepFreedMemory keepFreed_;
  Stream stream_;
  BrickTable bricks_;
  PairLists lists_;
  ThreadsPerBrick threads_;
  DeviceBuffer<float> targetValues_, constants_;
  DeviceBuffer<BrickMask> active_;
  GrowingBuffer<Ellipsoid> ellipsoids_;
  GrowingBuffer<AdamState> adam_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<Usefulness> usefulness_;
  GrowingBuffer<ListedSupport> listed_;
  GrowingBuffer<float> moments_, residual_;
  GrowingBuffer<double> brickLoss_, chunkSums_, slope_;
  std::size_t stepped_ = 0;  ///< number of ellipsoids that took part in the last step
  DeviceBuffer<StepStatus> status_;
  VoxelSampling sampling_;
  EllipsoidRanking ranking_;
  ErrorSums errorSums_;
  std::size_t count_ = 0;
  double secondsSeeding_ = 0.0;
  std::uint64_t samplings_ = 0;  ///< number of samplings, each with its own random numbers
  double loss_ = 0.0;            ///< sum of r^2 before the last step
  bool stale_ = true;            ///< whether the lists are outdated
  std::size_t served_ = 0;       ///< steps taken with the current lists
  std::size_t ahead_ = 8;        ///< steps to start before the next look()
  bool full_ = false;            ///< memory ran out, so no more ellipsoids are added
};

}  // namespace esvr::cuda
