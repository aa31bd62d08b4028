#include "esvr/fit.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"
#include "fit/empty_fit.h"
#include "fit/export_field.h"
#include "fit/import_field.h"
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

void check(const FitOptions& options) {
  if (options.count && *options.count == 0) throw UsageError("count must be at least 1");
  if (options.iterations && *options.iterations == 0)
    throw UsageError("iterations must be at least 1");
  if (options.seconds && !(*options.seconds > 0.0)) throw UsageError("seconds must be positive");
  if (options.psnr && !std::isfinite(*options.psnr)) throw UsageError("psnr must be finite");
  if (options.kappa && !std::isfinite(*options.kappa)) throw UsageError("kappa must be finite");
  if (!(options.voxelShare >= 0.0 && options.voxelShare <= 1.0))
    throw UsageError("the share of iterations at voxels must be between 0 and 1");
  if (options.box && options.box->empty()) throw UsageError("the box is empty");
}

std::vector<Ellipsoid> startOf(const FitOptions& options, Coord origin, double scale) {
  if (!options.start) return {};
  return importField(*options.start, origin, scale);
}

float firstKappa(const FitOptions& options, const Tuning& tuning) {
  if (options.kappa) return *options.kappa;
  return options.start ? options.start->kernel.kappa : tuning.firstKappa;
}

RunPlan planFor(const FitTarget& target, const FitOptions& options) {
  RunPlan plan;
  plan.count = plannedCount(options, target.activeVoxels);
  plan.iterations = plannedIterations(options);
  plan.psnr = options.psnr;
  plan.seconds = options.seconds;
  plan.learnKappa = !options.kappa;
  return plan;
}

ValueRange rangeOf(float background, const FitTarget& target) {
  return {float(background + target.lowest / target.scale),
          float(background + target.highest / target.scale)};
}

bool anyNegative(const Field& field) {
  return std::any_of(field.chunks.begin(), field.chunks.end(), [](const Chunk& chunk) {
    const auto& i = chunk.ellipsoids.intensity;
    return std::any_of(i.begin(), i.end(), [](float v) { return v < 0.0f; });
  });
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
  check(options);
  const Tuning tuning;
  FitTarget target = makeTarget(volume, options.box);
  target.saturates = true;
  target.narrowBand = options.narrowBand;
  target.bothSigns = options.bothSigns.value_or(false);
  if (options.fitFor == FitFor::kDrawing) target.voxelShare = options.voxelShare;
  if (isEmpty(target)) return emptyFit(volume, options.kappa.value_or(Kernel{}.kappa));

  Recorder recorder(target, options);
  const auto start = startOf(options, volume.origin, target.scale);
  RunPlan plan = planFor(target, options);
  plan.start = start;
  if (start.size() > plan.count)
    throw UsageError("a fit of " + std::to_string(plan.count) +
                     " ellipsoids cannot continue from " + std::to_string(start.size()));
  OptimiserOptions optimiserOptions{{}, options.seed, options.device, options.maxDeviceBytes};
  optimiserOptions.kernel.kappa = firstKappa(options, tuning);

  const auto optimiser = makeOptimiser(target, optimiserOptions, tuning);
  const RunEnd end = run(*optimiser, target, recorder, plan, tuning);
  if (end.end == FitEnd::kCancelled && optimiser->ellipsoidCount() == 0) throw Cancelled();
  optimiser->dropUnseen();
  recorder.record(*optimiser, end.iterations);

  FitResult result;
  result.field = exportField(optimiser->ellipsoids(),
                             {volume.origin, target.scale, volume.background, optimiser->kernel()});
  result.field.fitFor = options.fitFor;
  result.range = rangeOf(volume.background, target);
  result.kappaLearned = plan.learnKappa;
  result.end = end.end;
  result.curve = recorder.curve();
  result.wanted = plan.count;
  result.deviceBytes = optimiser->deviceBytes();
  result.deviceFull = optimiser->deviceFull();
  result.pairs = optimiser->pairCount();
  result.signedIntensities = anyNegative(result.field);
  result.secondsSeed = optimiser->secondsSeeding();
  result.secondsOptimise = recorder.seconds() - result.secondsSeed;
  return result;
}

}  // namespace esvr
