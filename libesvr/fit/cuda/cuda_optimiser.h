#pragma once
/// A fit on a GPU. What runs over bricks, pairs and ellipsoids is in the kernels beside this file;
/// here is their order.

#include <optional>
#include <span>
#include <vector>

#include "core/cuda/memory_pool.h"
#include "core/cuda/stream.h"
#include "fit/cuda/brick_pass.h"
#include "fit/cuda/brick_table.h"
#include "fit/cuda/error_sums.h"
#include "fit/cuda/pair_lists.h"
#include "fit/cuda/rank_ellipsoids.h"
#include "fit/cuda/sample_voxels.h"
#include "fit/cuda/step.h"
#include "fit/cuda/step_status.h"
#include "fit/cuda/threads_per_brick.h"
#include "fit/optimiser.h"

namespace esvr::cuda {

class CudaOptimiser final : public Optimiser {
 public:
  /// The device of the options must be the current one.
  CudaOptimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning);

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

  /// Gradients of 1/2 sum r^2 where the ellipsoids are.
  /// \param threads  ThreadsPerBrick::threads of a choice; changes no bit
  [[nodiscard]] std::vector<EllipsoidGradient> gradients(int threads = ThreadsPerBrick::threads(1));
  /// Takes over ellipsoids as they are; they have taken no step yet.
  void setEllipsoids(std::span<const Ellipsoid> ellipsoids);

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
  [[nodiscard]] std::vector<Ellipsoid> seenEllipsoids();

  void releaseScratch();
  void keep(std::span<const std::size_t> places);
  void dropLeastUseful();
  template <class Work>
  auto withRoom(const Work& work);
  template <class Work>
  auto withFewer(const Work& work);
  /// \return how many seeds there are: `count`, fewer where errors are few
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
  std::optional<LimitMemory> limit_;
  KeepFreedMemory keepFreed_;
  Stream stream_;
  BrickTable bricks_;
  PairLists lists_;
  ThreadsPerBrick threads_;
  DeviceBuffer<float> targetValues_;
  DeviceBuffer<BrickMask> active_;
  GrowingBuffer<Ellipsoid> ellipsoids_;
  GrowingBuffer<AdamState> adam_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<Usefulness> usefulness_;
  GrowingBuffer<ListedSupport> listed_;
  GrowingBuffer<float> moments_, residual_;
  GrowingBuffer<double> brickLoss_, chunkSums_, slope_;
  std::size_t stepped_ = 0;  ///< ellipsoids that took part in the last step
  DeviceBuffer<StepStatus> status_;
  VoxelSampling sampling_;
  EllipsoidRanking ranking_;
  ErrorSums errorSums_;
  std::size_t count_ = 0;
  double secondsSeeding_ = 0.0;
  std::uint64_t samplings_ = 0;  ///< events so far: each draws from its own random stream
  double loss_ = 0.0;            ///< before the last step
  bool stale_ = true;            ///< the lists
  std::size_t served_ = 0;       ///< steps that the lists have served
  std::size_t ahead_ = 8;        ///< steps to start before the next look
  bool full_ = false;            ///< memory was out: there will be no more ellipsoids
};

}  // namespace esvr::cuda
