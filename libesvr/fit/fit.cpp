#include "esvr/fit.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "fit/export_field.h"
#include "fit/paper/fit_paper.h"
#include "fit/run.h"

namespace esvr {
namespace {

/// What a preset stands for.
struct PresetValues {
  double voxelsPerEllipsoid;  ///< active voxels
  std::uint32_t iterations;   ///< on the CPU
};
PresetValues valuesOf(Preset preset) {
  switch (preset) {
    case Preset::kDraft:
      return {100.0, 400};
    case Preset::kHigh:
      return {12.0, 5000};
    case Preset::kStandard:
      break;
  }
  return {35.0, 1500};
}

/// A GPU's iterations cost little: a third more of them.
std::uint32_t iterationsOf(const PresetValues& preset, DeviceKind device) {
  return device == DeviceKind::kCuda ? preset.iterations * 4 / 3 : preset.iterations;
}

constexpr std::uint32_t kStretchIterations = 400;  // of a --psnr run between two sizes
constexpr double kFirstGuess = 4.0;  // a --psnr run starts at the preset's count over this

void check(const FitOptions& options) {
  if (options.count && *options.count == 0) throw UsageError("count must be at least 1");
  if (options.iterations && *options.iterations == 0)
    throw UsageError("iterations must be at least 1");
  if (options.seconds && !(*options.seconds > 0.0)) throw UsageError("seconds must be positive");
  if (options.psnr && !std::isfinite(*options.psnr)) throw UsageError("psnr must be finite");
  if (options.kappa && !std::isfinite(*options.kappa)) throw UsageError("kappa must be finite");
  if (!(options.beta >= 0.0 && options.beta <= 1.0))
    throw UsageError("beta must be within 0 and 1");
  if (options.loss == Loss::kPaper && options.narrowBand)
    throw UsageError(
        "the paper's loss compares windows, which a narrow band does not fill: use squared");
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
  if (options.paper) paper::checkPaper(options);
}

RunPlan planFor(const FitTarget& target, const FitOptions& options) {
  const PresetValues preset = valuesOf(options.preset);
  const auto voxels = std::size_t(target.activeVoxels);
  const auto clampCount = [&](std::size_t n) { return std::clamp<std::size_t>(n, 1, voxels); };
  const auto byPreset = clampCount(std::size_t(double(voxels) / preset.voxelsPerEllipsoid));
  RunPlan plan;
  plan.psnr = options.psnr;
  plan.seconds = options.seconds;
  // under the paper's loss the descent gained nothing
  plan.learnKappa = !options.kappa && options.loss == Loss::kSquared;
  plan.largestCount = clampCount(options.count.value_or(voxels));
  plan.count = options.psnr ? clampCount(std::size_t(double(byPreset) / kFirstGuess))
                            : clampCount(options.count.value_or(byPreset));
  plan.count = std::min(plan.count, plan.largestCount);
  plan.iterations = options.iterations.value_or(
      options.psnr ? kStretchIterations : iterationsOf(preset, options.device.kind));
  return plan;
}

/// Growth towards a PSNR goes in short attempts. Where they miss it with the largest number that
/// was allowed, that number is worth a run of its own, from the start and whole.
std::optional<RunPlan> wholeRun(const RunPlan& plan, const RunEnd& end, const FitOptions& options) {
  if (end.end != FitEnd::kPsnrMissed || !options.count || options.iterations) return std::nullopt;
  RunPlan whole = plan;
  whole.count = plan.largestCount;
  whole.iterations = iterationsOf(valuesOf(options.preset), options.device.kind);
  whole.firstIteration = end.iterations;
  return whole;
}

bool anyNegative(const Field& field) {
  return std::any_of(field.chunks.begin(), field.chunks.end(), [](const Chunk& chunk) {
    const auto& i = chunk.ellipsoids.intensity;
    return std::any_of(i.begin(), i.end(), [](float v) { return v < 0.0f; });
  });
}

/// Nothing differs from the background: the empty sum is exact.
FitResult emptyFit(const SparseVolume& volume, const FitOptions& options) {
  FitResult result;
  result.field.background = volume.background;
  result.field.kernel.kappa = options.kappa.value_or(Kernel{}.kappa);
  TimedCurvePoint point;
  point.psnrBox = point.psnrActive = kPerfectPsnr;
  result.curve.push_back(point);
  return result;
}

}  // namespace

FitResult fit(const SparseVolume& volume, const FitOptions& options) {
  check(options);
  const Tuning tuning;
  FitTarget target = makeTarget(volume, options.box);
  target.narrowBand = options.narrowBand;
  if (target.lowest == 0.0 && target.highest == 0.0) return emptyFit(volume, options);
  if (options.paper) return paper::fitPaper(volume, target, options);

  Recorder recorder(target, options);
  const RunPlan plan = planFor(target, options);
  OptimiserOptions optimiserOptions{{},           options.loss,   options.beta,
                                    options.seed, options.device, options.maxDeviceBytes};
  optimiserOptions.kernel.kappa = options.kappa.value_or(tuning.firstKappa);

  FitResult result;
  auto optimiser = makeOptimiser(target, optimiserOptions, tuning);
  RunEnd end = run(*optimiser, target, recorder, plan, tuning);
  if (const auto whole = wholeRun(plan, end, options)) {
    optimiser.reset();  // its memory first
    optimiser = makeOptimiser(target, optimiserOptions, tuning);
    end = run(*optimiser, target, recorder, *whole, tuning);
  }
  if (end.end == FitEnd::kCancelled && optimiser->ellipsoidCount() == 0) throw Cancelled();
  optimiser->dropUnseen();
  recorder.record(*optimiser, end.iterations);

  result.field = exportField(optimiser->ellipsoids(),
                             {volume.origin, target.scale, volume.background, optimiser->kernel()});
  result.kappaLearned = plan.learnKappa;
  result.end = end.end;
  result.curve = recorder.curve();
  result.deviceBytes = optimiser->deviceBytes();
  result.pairs = optimiser->pairCount();
  result.signedIntensities = anyNegative(result.field);
  result.secondsSeed = optimiser->secondsSeeding();
  result.secondsOptimise = recorder.seconds() - result.secondsSeed;
  return result;
}

}  // namespace esvr
