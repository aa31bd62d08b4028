#include "esvr/fit.h"

#include <string>

#include "esvr/error.h"
#include "fit/chunks/chunks_for.h"
#include "fit/chunks/fit_in_chunks.h"
#include "fit/empty_fit.h"
#include "fit/export_field.h"
#include "fit/fit_plan.h"
#include "fit/import_field.h"
#include "fit/run.h"

namespace esvr {
namespace {

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
  const Tuning tuning;
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
  recorder.record(*optimiser, end.iterations);

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

FitResult fit(const SparseVolume& volume, const FitOptions& options) {
  checkOptions(options);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  CancelScope::check();
  const TargetScale scale = scaleOf(volume, options.peak);
  if (isEmpty(scale)) return emptyFit(volume, options.kappa.value_or(Kernel{}.kappa));
  const std::size_t count = plannedCount(options, activeVoxelCount(volume));
  if (options.start && options.start->ellipsoidCount() > count)
    throw UsageError("a fit of " + std::to_string(count) + " ellipsoids cannot continue from " +
                     std::to_string(options.start->ellipsoidCount()));
  const auto chunks = chunksFor(volume, options);
  return chunks.size() > 1 ? fitInChunks(volume, options, scale, chunks)
                           : fitWhole(volume, options, scale);
}

}  // namespace esvr
