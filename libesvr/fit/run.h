#pragma once
/// Runs an optimiser until the goal of the fit is reached, with the clock, the curve and the
/// progress reports of the fit.

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "esvr/fit.h"
#include "fit/optimiser.h"

namespace esvr {

/// 10 log10(peak^2 N / sum of squares), at most kPerfectPsnr, so that curves are finite.
[[nodiscard]] double psnrOf(double squaredSum, double voxels, double peak);
inline constexpr double kPerfectPsnr = 999.0;

/// Sets the members that follow from the time and the fraction.
void addRates(FitProgress& progress, std::uint64_t activeVoxels);

class Recorder {
 public:
  Recorder(const FitTarget& target, const CommonFitOptions& options)
      : target_(target), options_(options) {}

  [[nodiscard]] double seconds() const;
  [[nodiscard]] bool cancelled() const {
    return CancelScope::cancelled() || (options_.cancel && options_.cancel->cancelled());
  }

  /// Appends a point to the curve.
  const TimedCurvePoint& record(const FitErrors& errors, std::size_t ellipsoids,
                                std::uint32_t iteration);

  /// Reports progress about four times a second.
  void report(const TimedCurvePoint& now, double fraction);

  [[nodiscard]] const std::vector<TimedCurvePoint>& curve() const { return curve_; }

 private:
  using Clock = std::chrono::steady_clock;
  const FitTarget& target_;
  const CommonFitOptions& options_;
  Clock::time_point start_ = Clock::now();
  double lastReport_ = -1.0;
  std::vector<TimedCurvePoint> curve_;
};

/// Gradient descent on the kernel's edge, which all ellipsoids share, by Adam on this parameter.
class KappaDescent {
 public:
  /// \param largestStep  largest change of kappa by one call
  explicit KappaDescent(double largestStep) : largestStep_(largestStep) {}

  /// \param slope   dL/dkappa at `kappa`
  /// \param factor  factor of the step's size
  /// \return the next kappa, within [kSmoothest, kHardest]
  [[nodiscard]] float next(float kappa, double slope, double factor);

  /// Below the first limit the kernel is a Gaussian in float32, above the second it is a step.
  static constexpr double kSmoothest = -8.0, kHardest = 30.0;

 private:
  double largestStep_;
  double mean_ = 0.0, square_ = 0.0;
  double meanWeight_ = 0.0, squareWeight_ = 0.0;
};

/// Sets the members of a target that follow from options.
void applyOptions(const FitOptions& options, FitTarget& target);

/// The kappa with which a fit begins.
[[nodiscard]] float firstKappa(const FitOptions& options, const Tuning& tuning);

/// The number of seeds with which a fit of `count` ellipsoids begins.
[[nodiscard]] std::size_t firstSeeds(std::size_t count, const Tuning& tuning);

[[nodiscard]] bool anyNegative(std::span<const Ellipsoid> ellipsoids);

/// The fit of a volume whose values all equal its background.
[[nodiscard]] FitResult emptyFit(const SparseVolume& volume, float kappa);

/// The parameters of a run, with all defaults resolved.
struct RunPlan {
  std::size_t firstCount = 0;     ///< ellipsoids at the start of growth
  std::size_t count = 0;          ///< ellipsoids at the end of growth
  std::uint32_t iterations = 0;   ///< length of the schedule
  std::optional<double> psnr;     ///< dB over the box; the run ends as soon as it is reached
  std::optional<double> seconds;  ///< time limit; replaces `iterations` as length of the schedule
  FitState start{};               ///< ellipsoids to begin with; empty: seeds
  bool learnKappa = false;        ///< whether kappa is fitted or stays the same
  double from = 0.0, to = 1.0;    ///< the part of the schedule that is run
  bool curve = true;              ///< whether points of the curve are measured during the run
};

struct RunEnd {
  FitEnd end;
  std::uint32_t iterations;  ///< number of iterations done
};

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
           const Tuning& tuning);

}  // namespace esvr
