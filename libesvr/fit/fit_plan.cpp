#include "fit/fit_plan.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"

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

void applyOptions(const FitOptions& options, FitTarget& target) {
  target.saturates = true;
  target.narrowBand = options.narrowBand;
  target.bothSigns = options.bothSigns.value_or(false);
}

float firstKappa(const FitOptions& options, const Tuning& tuning) {
  if (options.kappa) return *options.kappa;
  return options.start ? options.start->kernel.kappa : tuning.firstKappa;
}

ValueRange rangeOf(float background, const TargetScale& scale) {
  return {float(background + scale.lowest / scale.scale),
          float(background + scale.highest / scale.scale)};
}

bool anyNegative(std::span<const Ellipsoid> ellipsoids) {
  return std::any_of(ellipsoids.begin(), ellipsoids.end(),
                     [](const Ellipsoid& p) { return p.intensity < 0.0; });
}

}  // namespace esvr
