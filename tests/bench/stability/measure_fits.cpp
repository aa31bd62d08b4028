#include "stability.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "esvr/error.h"
#include "esvr/fit.h"
#include "fit/ellipsoid.h"
#include "fit/run.h"

namespace esvr::bench {
namespace {

bool isFinite(const Ellipsoid& p) {
  const auto finite = [](double v) { return std::isfinite(v); };
  return std::ranges::all_of(p.center, finite) && std::ranges::all_of(p.L, finite) &&
         finite(p.intensity);
}

/// The fits of one volume.
class Fits {
 public:
  Fits(const FitCase& fitCase, const Device& device, std::uint32_t iterations)
      : case_(fitCase), volume_(fitCase.volume()) {
    options_.count = fitCase.count;
    options_.kappa = fitCase.kappa;
    options_.iterations = iterations;
    options_.device = device;
    target_ = makeTarget(volume_, std::nullopt);
    applyOptions(options_, target_);
  }

  [[nodiscard]] FitFigures measure() const {
    FitFigures figures;
    figures.activeVoxels = target_.activeVoxels;
    double squares = 0.0;
    for (const float v : target_.values) squares += double(v) * v;
    figures.psnrOfNothing = psnrOf(squares, target_.boxVoxels, target_.peak);
    if (case_.chunkVoxels > 0) {
      figures.runs.push_back(inChunks());
      figures.inOneChunk = withFactor(1.0);
    } else {
      for (const double factor : kFactors) figures.runs.push_back(withFactor(factor));
    }
    return figures;
  }

 private:
  [[nodiscard]] RunPlan plan(const Tuning& tuning) const {
    RunPlan plan;
    plan.count = case_.start ? case_.count : plannedCount(options_, target_.activeVoxels);
    plan.firstCount = firstSeeds(plan.count, tuning);
    if (case_.start) {
      plan.start = stateOf(importField(case_.start(), volume_.origin, target_.scale));
      plan.firstCount = plan.start.ellipsoids.size();
    }
    plan.iterations = *options_.iterations;
    plan.learnKappa = !options_.kappa;
    return plan;
  }

  [[nodiscard]] FitRun withFactor(double factor) const {
    Tuning tuning;
    tuning.steps = tuning.steps.scaled(factor);
    OptimiserOptions optimiserOptions;
    optimiserOptions.kernel.kappa = firstKappa(options_, tuning);
    optimiserOptions.device = options_.device;
    Recorder recorder(target_, options_);
    FitRun result{.factor = factor};
    const auto optimiser = makeOptimiser(target_, optimiserOptions, tuning);
    try {
      result.iterations = run(*optimiser, target_, recorder, plan(tuning), tuning).iterations;
      recorder.record(optimiser->measure(), optimiser->ellipsoidCount(), result.iterations);
    } catch (const RuntimeFailure& failure) {
      result.failure = failure.what();
    }
    result.curve = recorder.curve();
    const auto ellipsoids = optimiser->ellipsoids();
    result.ellipsoids = ellipsoids.size();
    result.finite = std::ranges::all_of(ellipsoids, isFinite);
    summarise(result);
    return result;
  }

  /// The fit in chunks, whose step sizes are those of fit().
  [[nodiscard]] FitRun inChunks() const {
    FitOptions options = options_;
    options.chunkVoxels = case_.chunkVoxels;
    const FitResult fitted = fit(volume_, options);
    FitRun result{.iterations = *options.iterations,
                  .ellipsoids = fitted.field.ellipsoidCount(),
                  .curve = fitted.curve};
    for (const Chunk& chunk : fitted.field.chunks) result.finite &= wellFormed(chunk.ellipsoids);
    summarise(result);
    return result;
  }

  /// Sets the errors to those of the last point, which are in the units of the volume.
  void summarise(FitRun& result) const {
    if (result.curve.empty()) return;
    const TimedCurvePoint& last = result.curve.back();
    result.psnr = last.psnrBox;
    result.largestError = last.maxError * target_.scale / target_.peak;
    result.finite = result.finite && std::isfinite(last.psnrBox) && std::isfinite(last.maxError);
  }

  const FitCase& case_;
  SparseVolume volume_;
  FitOptions options_;
  FitTarget target_;
};

}  // namespace

FitFigures measureFits(const FitCase& fitCase, const Device& device, std::uint32_t iterations) {
  return Fits(fitCase, device, iterations).measure();
}

}  // namespace esvr::bench
