// Gradients against differences in float64, and fits with step sizes around those of fit().

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>

#include "bench/stability/stability.h"
#include "core/device_choice.h"
#include "esvr/error.h"
#include "esvr/fit.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/ellipsoid.h"
#include "fit/run.h"
#ifdef ESVR_WITH_CUDA
#include "core/cuda/runtime.h"
#include "fit/cuda/cuda_optimiser.h"
#endif

namespace esvr::bench {
namespace {

// Gradients.

std::vector<EllipsoidGradient> gradientsOnCpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids) {
  constexpr double kSlack = 0.1;  // voxels
  CpuPass pass(target, kernelConstants<double>(kernel));
  pass.rebuild(ellipsoids, kSlack);
  std::vector<EllipsoidGradient> gradients(ellipsoids.size());
  pass.gradients(ellipsoids, gradients);
  return gradients;
}

/// The largest error of the derivatives of one ellipsoid; infinite if one is not finite.
double largestError(const EllipsoidGradient& found, const test::Differences& expected) {
  double largest = std::abs(found.byKappa - expected.by[kParameters]);
  for (int n = 0; n < kParameters; ++n) {
    const double error = std::abs(found.byParameter[std::size_t(n)] - expected.by[n]);
    if (!std::isfinite(error)) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, error);
  }
  return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
}

/// The ellipsoids of a case, and others behind them.
std::vector<Ellipsoid> withCrowd(const test::GradientCase& c, const test::SmallTarget& target,
                                 std::size_t crowd) {
  std::vector<Ellipsoid> all = test::ellipsoidsOf(c, target);
  test::Random random(47);
  for (std::size_t n = 0; n < crowd; ++n) {
    Ellipsoid other = test::atAVoxel(c, random);
    other.intensity /= double(crowd);
    all.push_back(other);
  }
  return all;
}

#ifdef ESVR_WITH_CUDA
std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids,
                                              const Device& device) {
  cuda::useDevice(device);
  OptimiserOptions options;
  options.kernel = kernel;
  options.device = device;
  cuda::CudaOptimiser optimiser(target, options, {});
  optimiser.setEllipsoids(ellipsoids);
  return optimiser.gradients();
}
#else
std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget&, const Kernel&,
                                              std::span<const Ellipsoid>, const Device& device) {
  refuseCuda("gradients", device);
}
#endif

}  // namespace

GradientErrors measureGradients(const test::GradientCase& c, std::size_t crowd,
                                const Device& device) {
  const test::SmallTarget target;
  const auto ellipsoids = withCrowd(c, target, crowd);
  const auto residuals = test::residualsOf(target, c, ellipsoids);
  const Kernel kernel{.kappa = c.kappa};
  const auto gradients = device.kind == DeviceKind::kCuda
                             ? gradientsOnGpu(target.get(), kernel, ellipsoids, device)
                             : gradientsOnCpu(target.get(), kernel, ellipsoids);
  GradientErrors errors;
  for (std::size_t i = 0; i < ellipsoids.size() - crowd; ++i) {
    const test::Differences expected = test::differencesOf(target, c, ellipsoids[i], residuals);
    const double error = largestError(gradients[i], expected) / expected.magnitude;
    const double bound = test::toleranceOf(c, ellipsoids[i]);
    errors.largest = std::max(errors.largest, error);
    errors.bound = std::max(errors.bound, bound);
    errors.shareOfBound = std::max(errors.shareOfBound, error / bound);
  }
  return errors;
}

namespace {

// Fits.

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
