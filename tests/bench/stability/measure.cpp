// Measures the cases of docs/figures/stability.md on one device, and writes the figures as JSON:
//
//     bench_stability OUT.json [--device cpu|cuda|cuda:N] [--machine TEXT] [--iterations N] [--only TEXT]
//
// TEXT of --machine describes the machine on the page. --only measures the cases whose names contain
// TEXT. tests/bench/bench.py makes the page from these files. Gradients are measured against differences in float64,
// and fits with step sizes around those of fit().

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bench/stability/stability.h"
#include "core/device_choice.h"
#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/fit.h"
#include "esvr/render.h"
#include "fit/cpu/cpu_pass.h"
#include "fit/ellipsoid.h"
#include "fit/run.h"
#include "support/stability.h"

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

// ---- The program

namespace {

using namespace esvr;
using Json = nlohmann::ordered_json;

constexpr std::uint32_t kIterations = 400;

struct Options {
  std::string output, device = "cpu", machine, only;
  std::uint32_t iterations = kIterations;
};

Json finiteOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The number of leading decimal digits that a difference leaves correct: the largest whole d with difference <= 10^-d
/// peak, at most 17, which stands for no difference.
int correctDigits(double difference, double peak) {
  constexpr int kMost = std::numeric_limits<double>::max_digits10;
  if (difference == 0.0) return kMost;
  const double share = difference / peak;
  return share < 1.0 ? std::min(kMost, int(std::floor(-std::log10(share)))) : 0;
}

Json evaluation(const Field& field, const Device& device) {
  const test::Stability s = test::measureStability(field, {.samples = 512, .device = device});
  return {{"max", finiteOrNull(s.largest)},
          {"rms", finiteOrNull(s.rms)},
          {"bound", s.bound},
          {"share_of_bound", finiteOrNull(s.shareOfBound)},
          {"peak", s.peak},
          {"digits", correctDigits(s.largest, s.peak)},
          {"at", {s.at.x, s.at.y, s.at.z}},
          {"overlap", s.largestOverlap},
          {"cancellation", s.cancellation},
          {"condition", s.largestCondition}};
}

Json gradients(const bench::StabilityCase& c, const Device& device) {
  const bench::GradientErrors errors = bench::measureGradients(*c.gradients, c.crowd, device);
  return {{"max", finiteOrNull(errors.largest)},
          {"bound", errors.bound},
          {"share_of_bound", finiteOrNull(errors.shareOfBound)}};
}

/// A number with few decimals, so that files are short. \param perUnit  a power of ten
double rounded(double value, double perUnit) { return std::round(value * perUnit) / perUnit; }

/// The curves that the page shows; those of the other factors are only needed at their ends.
Json curveOf(const bench::FitRun& run) {
  constexpr double kLargestFactor = 2.0;
  Json curve = Json::array();
  if (run.factor > kLargestFactor) return curve;
  for (const TimedCurvePoint& p : run.curve)
    curve.push_back({rounded(p.seconds, 1e5), rounded(p.psnrBox, 1e3)});
  return curve;
}

Json toJson(const bench::FitRun& run) {
  return {{"factor", run.factor},
          {"psnr", finiteOrNull(run.psnr)},
          {"max_error", finiteOrNull(run.largestError)},
          {"iterations", run.iterations},
          {"ellipsoids", run.ellipsoids},
          {"finite", run.finite},
          {"failure", run.failure},
          {"curve", curveOf(run)}};
}

Json fits(const bench::FitCase& c, const Device& device, std::uint32_t iterations) {
  const bench::FitFigures figures = bench::measureFits(c, device, iterations);
  Json runs = Json::array();
  for (const bench::FitRun& run : figures.runs) runs.push_back(toJson(run));
  return {{"active_voxels", figures.activeVoxels},
          {"psnr_of_nothing", finiteOrNull(figures.psnrOfNothing)},
          {"in_one_chunk", figures.inOneChunk ? toJson(*figures.inOneChunk) : Json(nullptr)},
          {"runs", std::move(runs)}};
}

Json measured(const bench::StabilityCase& c, const Device& device, const Options& options) {
  return {{"name", c.name},
          {"detail", c.detail},
          {"evaluation", c.field ? evaluation(c.field(), device) : Json(nullptr)},
          {"gradients", c.gradients ? gradients(c, device) : Json(nullptr)},
          {"fit", c.fit ? fits(*c.fit, device, options.iterations) : Json(nullptr)}};
}

Options parse(const std::vector<std::string>& words) {
  Options options;
  for (std::size_t n = 0; n < words.size(); ++n) {
    if (!words[n].starts_with("--")) {
      options.output = words[n];
      continue;
    }
    const std::string value = n + 1 < words.size() ? words[n + 1] : "";
    if (words[n] == "--device")
      options.device = value;
    else if (words[n] == "--iterations")
      options.iterations = std::uint32_t(std::stoul(value));
    else if (words[n] == "--machine")
      options.machine = value;
    else if (words[n] == "--only")
      options.only = value;
    else
      throw std::invalid_argument("unknown option " + words[n]);
    ++n;
  }
  if (options.output.empty()) throw std::invalid_argument("no output file");
  return options;
}

void run(const Options& options) {
  const Device device = selectDevice(options.device);
  std::ofstream out(options.output);
  out << "{\"device\": " << Json(deviceName(device)) << ", \"machine\": " << Json(options.machine)
      << ", \"iterations\": " << options.iterations << ", \"cases\": [";
  const char* separator = "\n";
  for (const bench::StabilityCase& c : bench::stabilityCases()) {
    if (c.name.find(options.only) == std::string::npos) continue;
    std::fprintf(stderr, "%s\n", c.name.c_str());
    out << std::exchange(separator, ",\n") << measured(c, device, options);
  }
  out << "\n]}\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + options.output);
}

}  // namespace

int main(int argc, char** argv) try {
  run(parse({argv + 1, argv + argc}));
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_stability: %s\n", error.what());
  return 1;
}
