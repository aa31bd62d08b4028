#include "fit/recorder.h"

#include <cmath>

namespace esvr {

double psnrOf(double squaredSum, double voxels, double peak) {
  if (squaredSum <= 0.0) return kPerfectPsnr;
  return std::min(kPerfectPsnr, 10.0 * std::log10(peak * peak * voxels / squaredSum));
}

double Recorder::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

const TimedCurvePoint& Recorder::record(Optimiser& optimiser, std::uint32_t iteration) {
  return record(optimiser.measure(), optimiser.ellipsoidCount(), iteration);
}

const TimedCurvePoint& Recorder::record(const FitErrors& errors, std::size_t ellipsoids,
                                        std::uint32_t iteration) {
  TimedCurvePoint point;
  point.seconds = seconds();
  point.iteration = iteration;
  point.ellipsoids = ellipsoids;
  point.psnrBox = psnrOf(errors.squaredSumBox, target_.boxVoxels, target_.peak);
  point.psnrActive = psnrOf(errors.squaredSumActive, double(target_.activeVoxels), target_.peak);
  point.maxError = errors.largest / target_.scale;
  curve_.push_back(point);
  return curve_.back();
}

void Recorder::report(const TimedCurvePoint& now, double fraction) {
  constexpr double kInterval = 0.25;  // seconds
  if (!options_.progress || now.seconds - lastReport_ < kInterval) return;
  lastReport_ = now.seconds;
  FitProgress progress{.point = now, .fraction = fraction};
  addRates(progress, target_.activeVoxels);
  options_.progress(progress);
}

void addRates(FitProgress& progress, std::uint64_t activeVoxels) {
  const double seconds = progress.point.seconds, fraction = progress.fraction;
  if (seconds <= 0.0 || fraction <= 0.0) return;
  progress.secondsLeft = seconds * (1.0 - fraction) / fraction;
  progress.voxelsPerSecond = double(activeVoxels) * fraction / seconds;
}

}  // namespace esvr
