#pragma once
/// The state of a fit and the moves it is made of; run.h decides which comes when.

#include <cstdint>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "fit/adam.h"
#include "fit/engine.h"
#include "fit/paper_loss.h"
#include "fit/seed.h"
#include "fit/step_trust.h"
#include "fit/tuning.h"

namespace esvr {

struct OptimiserOptions {
  Kernel kernel;
  Loss loss = Loss::kSquared;
  double beta = 0.2;
  std::uint64_t seed = 1;
};

/// Errors of a fit as its curve reports them, in units of the target.
struct FitErrors {
  double squaredSum = 0.0;        ///< over all bricks
  double squaredSumBox = 0.0;     ///< over the target's box
  double squaredSumActive = 0.0;  ///< over the active voxels
  double largest = 0.0;
};

class Optimiser {
 public:
  /// The target must outlive the optimiser.
  Optimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning);

  /// Adds primitives where the error is, until there are `count`, or no error is left to mend.
  void growTo(std::size_t count);

  /// Moves `count` primitives whose removal costs least to where the error is.
  void relocate(std::size_t count);

  /// Gradients, and one step of `scale` times the tuned sizes. \return sum of r^2 before the step
  /// \throws RuntimeFailure  the loss is not finite
  double iterate(double scale);

  [[nodiscard]] FitErrors measure();

  /// Drops primitives that no voxel sees. They cost bytes and change nothing.
  void dropUnseen();

  [[nodiscard]] const std::vector<Primitive>& primitives() const { return primitives_; }
  /// Spent so far on finding where primitives are missing and shaping them.
  [[nodiscard]] double secondsSeeding() const { return secondsSeeding_; }
  [[nodiscard]] std::uint64_t pairCount() const { return engine_.pairs().pairCount(); }
  [[nodiscard]] const Tuning& tuning() const { return tuning_; }

 private:
  [[nodiscard]] std::vector<Primitive> newSeeds(std::size_t count);
  [[nodiscard]] std::vector<std::size_t> leastUseful(std::size_t count) const;
  void rebuildLists();
  void refreshResiduals();
  double takeGradients();
  double takePaperGradients();

  const FitTarget& target_;
  OptimiserOptions options_;
  Tuning tuning_;
  FitEngine engine_;
  PaperLoss paperLoss_;
  StepTrust trust_;
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
