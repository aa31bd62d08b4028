#include "esvr/fit.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "fit/chunks/chunks.h"
#include "fit/run.h"

namespace esvr {
namespace {

struct PresetValues {
  double voxelsPerEllipsoid;  ///< active voxels per ellipsoid
  std::uint32_t iterations;   ///< iterations on the CPU
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

void checkOptions(const FitOptions& options) {
  if (options.count && *options.count == 0) throw UsageError("count must be at least 1");
  if (options.iterations && *options.iterations == 0)
    throw UsageError("iterations must be at least 1");
  if (options.seconds && !(*options.seconds > 0.0)) throw UsageError("seconds must be positive");
  if (options.psnr && !std::isfinite(*options.psnr)) throw UsageError("psnr must be finite");
  if (options.peak && !(*options.peak > 0.0 && std::isfinite(*options.peak)))
    throw UsageError("the peak must be positive");
  if (options.kappa && !std::isfinite(*options.kappa)) throw UsageError("kappa must be finite");
  if (options.chunkVoxels && *options.chunkVoxels == 0)
    throw UsageError("a chunk must have at least 1 voxel");
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
}

RunPlan planFor(const FitTarget& target, const FitOptions& options, const Tuning& tuning,
                Coord origin) {
  RunPlan plan;
  plan.count = plannedCount(options, target.activeVoxels);
  plan.firstCount = firstSeeds(plan.count, tuning);
  if (options.start) {
    plan.start = stateOf(importField(*options.start, origin, target.scale));
    plan.firstCount = plan.start.ellipsoids.size();
  }
  plan.iterations = plannedIterations(options);
  plan.psnr = options.psnr;
  plan.seconds = options.seconds;
  plan.learnKappa = !options.kappa;
  return plan;
}

/// Fits all bricks together.
FitResult fitWhole(const SparseVolume& volume, const FitOptions& options,
                   const TargetScale& scale) {
  const Tuning tuning = Tuning::forRun(plannedIterations(options));
  FitTarget target = makeTarget(volume, boxOf(volume, options.box), scale);
  applyOptions(options, target);
  Recorder recorder(target, options);
  const RunPlan plan = planFor(target, options, tuning, volume.origin);
  OptimiserOptions optimiserOptions{{}, options.seed, options.device, options.maxDeviceBytes};
  optimiserOptions.kernel.kappa = firstKappa(options, tuning);

  const auto optimiser = makeOptimiser(target, optimiserOptions, tuning);
  const RunEnd end = run(*optimiser, target, recorder, plan, tuning);
  const bool isCancelled = end.end == FitEnd::kCancelled;
  if (isCancelled && optimiser->ellipsoidCount() == 0) throw Cancelled();
  const BestSoFar completion;
  if (!isCancelled) optimiser->dropUnseen();  // it takes as long as two iterations
  recorder.record(optimiser->measure(), optimiser->ellipsoidCount(), end.iterations);

  FitResult result;
  const auto ellipsoids = optimiser->ellipsoids();
  result.field = exportField(ellipsoids,
                             {volume.origin, target.scale, volume.background, optimiser->kernel()});
  result.range = rangeOf(volume.background, target);
  result.end = end.end;
  result.curve = recorder.curve();
  result.wanted = plan.count;
  result.chunks = 1;
  result.deviceBytes = optimiser->deviceBytes();
  result.deviceFull = optimiser->deviceFull();
  result.pairs = optimiser->pairCount();
  result.signedIntensities = anyNegative(ellipsoids);
  result.secondsSeed = optimiser->secondsSeeding();
  result.secondsOptimise = recorder.seconds() - result.secondsSeed;
  return result;
}

}  // namespace

std::size_t plannedCount(const FitOptions& options, std::uint64_t activeVoxels) {
  const double each = valuesOf(options.preset).voxelsPerEllipsoid;
  const auto byPreset = std::size_t(double(activeVoxels) / each);
  return std::clamp<std::size_t>(options.count.value_or(byPreset), 1,
                                 std::max<std::size_t>(activeVoxels, 1));
}

std::uint32_t plannedIterations(const FitOptions& options) {
  const std::uint32_t onCpu = valuesOf(options.preset).iterations;
  // A GPU makes a third more, because they take little time there.
  const bool onGpu = options.device.kind == DeviceKind::kCuda;
  return options.iterations.value_or(onGpu ? onCpu * 4 / 3 : onCpu);
}

FitResult fit(const SparseVolume& volume, const FitOptions& options) {
  checkOptions(options);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  CancelScope::check();
  const TargetScale scale = scaleOf(volume, options.peak);
  if (scale.empty()) return emptyFit(volume, options.kappa.value_or(Kernel{}.kappa));
  const std::size_t count = plannedCount(options, activeVoxelCount(volume));
  if (options.start && options.start->ellipsoidCount() > count)
    throw UsageError("a fit of " + std::to_string(count) + " ellipsoids cannot continue from " +
                     std::to_string(options.start->ellipsoidCount()));
  const auto chunks = chunksFor(volume, options);
  return chunks.size() > 1 ? fitInChunks(volume, options, scale, chunks)
                           : fitWhole(volume, options, scale);
}

}  // namespace esvr
