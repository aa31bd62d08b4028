#pragma once
/// The clock, the curve and the progress reports of a fit.

#include <chrono>
#include <functional>
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
  /// Measures the errors and appends a point to the curve.
  const TimedCurvePoint& record(Optimiser& optimiser, std::uint32_t iteration);

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

}  // namespace esvr
