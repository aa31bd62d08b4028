#pragma once
/// A fit on the CPU.

#include <cstdint>
#include <span>
#include <vector>

#include "fit/adam.h"
#include "fit/engine.h"
#include "fit/optimiser.h"
#include "fit/paper_loss.h"
#include "fit/seed.h"
#include "fit/tuning.h"

namespace esvr {

class CpuOptimiser final : public Optimiser {
 public:
  /// The target must outlive the optimiser.
  CpuOptimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning);

  void growTo(std::size_t count) override;
  void relocate(std::size_t count) override;
  double iterate(std::span<const double> factors) override;
  [[nodiscard]] std::uint32_t batchSize() const override { return 1; }
  [[nodiscard]] FitErrors measure() override;
  void dropUnseen() override;
  [[nodiscard]] const Kernel& kernel() const override { return options_.kernel; }
  [[nodiscard]] double kappaSlope() override;
  void setKappa(float kappa) override;

  [[nodiscard]] std::size_t primitiveCount() const override { return primitives_.size(); }
  [[nodiscard]] std::vector<Primitive> primitives() const override { return primitives_; }
  [[nodiscard]] std::size_t deviceBytes() const override { return 0; }
  [[nodiscard]] double secondsSeeding() const override { return secondsSeeding_; }
  [[nodiscard]] std::uint64_t pairCount() const override { return engine_.pairs().pairCount(); }

 private:
  [[nodiscard]] std::vector<Primitive> newSeeds(std::size_t count);
  [[nodiscard]] std::vector<std::size_t> leastUseful(std::size_t count) const;
  void rebuildLists();
  void refreshResiduals();
  double iterateOnce(double factor);
  double takeGradients();
  double takePaperGradients();

  const FitTarget& target_;
  OptimiserOptions options_;
  Tuning tuning_;
  FitEngine engine_;
  PaperLoss paperLoss_;
  double unitVariance_;
  PrimitiveLimits limits_;
  std::vector<Primitive> primitives_;
  std::vector<AdamState> states_;
  std::vector<PrimitiveGradient> gradients_;
  std::vector<float> residuals_;
  std::vector<float> lossByValue_;
  double secondsSeeding_ = 0.0;
  std::uint64_t draws_ = 0;          ///< events so far: each draws from its own random stream
  int iterationsSinceRebuild_ = -1;  ///< -1: lists are stale
};

}  // namespace esvr
