#pragma once
/// A fit's clock, curve and progress reports.

#include <chrono>
#include <functional>
#include <vector>

#include "esvr/fit.h"
#include "fit/optimiser.h"

namespace esvr {

/// 10 log10(peak^2 N / sum of squares); a perfect fit gives kPerfect, so that curves stay finite.
[[nodiscard]] double psnrOf(double squaredSum, double voxels, double peak);
inline constexpr double kPerfectPsnr = 999.0;

class Recorder {
 public:
  Recorder(const FitTarget& target, const CommonFitOptions& options)
      : target_(target), options_(options) {}

  [[nodiscard]] double seconds() const;
  [[nodiscard]] bool cancelled() const { return options_.cancel && options_.cancel->cancelled(); }

  /// Appends a point to the curve.
  const TimedCurvePoint& record(const FitErrors& errors, std::size_t ellipsoids,
                                std::uint32_t iteration);
  /// The same, measured exactly.
  const TimedCurvePoint& record(Optimiser& optimiser, std::uint32_t iteration);

  /// Reports progress if the last report is long enough ago.
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
