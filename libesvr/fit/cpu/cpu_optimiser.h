#pragma once
/// The optimiser on the CPU.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fit/cpu/cpu_pass.h"
#include "fit/optimiser.h"

namespace esvr {

class CpuOptimiser final : public Optimiser {
 public:
  /// The target must outlive the optimiser.
  CpuOptimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning);

  void setState(const FitState& state) override;
  [[nodiscard]] FitState state() const override { return {ellipsoids_, states_}; }
  void setEllipsoids(std::span<const Ellipsoid> ellipsoids) override;
  void growTo(std::size_t count) override;
  void relocate(std::size_t count) override;
  double iterate(std::span<const double> factors) override;
  [[nodiscard]] std::uint32_t batchSize() const override { return 1; }
  [[nodiscard]] FitErrors measure() override;
  [[nodiscard]] FitErrors measureBeforeIteration() override;
  void dropUnseen() override;
  [[nodiscard]] const Kernel& kernel() const override { return options_.kernel; }
  [[nodiscard]] double kappaSlope() override;
  void setKappa(float kappa) override;

  [[nodiscard]] std::size_t ellipsoidCount() const override { return ellipsoids_.size(); }
  [[nodiscard]] std::vector<Ellipsoid> ellipsoids() const override { return ellipsoids_; }
  [[nodiscard]] std::size_t deviceBytes() const override { return 0; }
  [[nodiscard]] double secondsSeeding() const override { return secondsSeeding_; }
  [[nodiscard]] std::uint64_t pairCount() const override { return pass_.pairs().pairCount(); }

 private:
  [[nodiscard]] std::vector<Ellipsoid> newSeeds(std::size_t count);
  [[nodiscard]] std::vector<std::size_t> leastUseful(std::size_t count) const;
  void rebuildLists();
  [[nodiscard]] bool anyOutgrown() const;
  void step(double factor);
  void buildTightLists();

  const FitTarget& target_;
  OptimiserOptions options_;
  Tuning tuning_;
  KernelConstants<double> kernel_;
  CpuPass pass_;
  double unitVariance_;
  EllipsoidLimits limits_;
  std::vector<Ellipsoid> ellipsoids_;
  std::vector<AdamState> states_;
  std::vector<EllipsoidGradient> gradients_;
  std::vector<float> residuals_;
  double secondsSeeding_ = 0.0;
  std::uint64_t samplings_ = 0;        ///< number of samplings, each with its own random numbers
  std::vector<ListedSupport> listed_;  ///< the supports that the lists of the iterations hold
  std::uint32_t refused_ = 0;          ///< steps that were refused since those lists were built
  bool stale_ = true;                  ///< true if those lists are outdated
  std::optional<double> loss_;  ///< sum of r^2, if gradients_ are those of the current ellipsoids
};

}  // namespace esvr
