#include "fit/pilot.h"

#include <algorithm>
#include <cmath>

#include "fit/run.h"

namespace esvr {
namespace {

/// How much of the volume a pilot fits, and for how long. On a GPU a part takes as long as the
/// whole of a volume of moderate size.
struct PilotSize {
  std::size_t bricks;
  std::uint32_t iterations;
};
constexpr PilotSize pilotSize(DeviceKind device) {
  return device == DeviceKind::kCuda ? PilotSize{20'000, 200} : PilotSize{400, 200};
}

constexpr float kCoarse[] = {-2.0f, 1.0f, 4.0f};
constexpr float kRefine[] = {-1.0f, 1.0f};
constexpr double kWorthIt = 0.02;  // dB: less is noise, the first found stays

/// A stretch of bricks in the middle of the order: neighbours, since the order is spatial.
struct Part {
  FitTarget target;
  std::vector<BrickMask> active;
};

Part partOf(const FitTarget& whole, std::size_t bricks) {
  const std::size_t n = std::min(bricks, whole.bricks.size());
  const std::size_t first = (whole.bricks.size() - n) / 2;
  const auto slice = [&](const auto& v, std::size_t per) {
    return std::vector(v.begin() + std::ptrdiff_t(first * per),
                       v.begin() + std::ptrdiff_t((first + n) * per));
  };
  Part part;
  part.active = slice(*whole.active, 1);
  part.target.scale = whole.scale;
  part.target.peak = whole.peak;
  part.target.narrowBand = whole.narrowBand;
  part.target.lowest = whole.lowest;
  part.target.highest = whole.highest;
  part.target.bricks = slice(whole.bricks, 1);
  part.target.values = slice(whole.values, kBrickVoxels);
  for (const auto& mask : part.active) part.target.activeVoxels += std::uint64_t(mask.count());
  part.target.boxVoxels = double(n) * kBrickVoxels;
  part.target.active = &part.active;
  return part;
}

double psnrAt(float kappa, const FitTarget& target, std::size_t count, OptimiserOptions options,
              const Tuning& tuning) {
  options.kernel.kappa = kappa;
  const auto optimiser = makeOptimiser(target, options, tuning);
  const FitOptions quiet;
  Recorder recorder(target, quiet);
  RunPlan plan;
  plan.count = count;
  plan.iterations = pilotSize(options.device.kind).iterations;
  run(*optimiser, target, recorder, plan, tuning);
  return psnrOf(optimiser->measure().squaredSum, target.boxVoxels, target.peak);
}

}  // namespace

PilotResult chooseKappa(const FitTarget& whole, std::size_t count, const OptimiserOptions& options,
                        const Tuning& tuning, const Recorder& recorder) {
  const Part part = partOf(whole, pilotSize(options.device.kind).bricks);
  const double share = double(part.target.activeVoxels) / double(whole.activeVoxels);
  const auto partCount = std::max<std::size_t>(1, std::size_t(std::llround(share * double(count))));
  PilotResult result{Kernel{}.kappa, {}};
  double best = -1e300;
  const auto attempt = [&](float kappa) {
    if (recorder.cancelled()) return;
    const double psnr = psnrAt(kappa, part.target, partCount, options, tuning);
    result.points.push_back({kappa, psnr});
    if (psnr > best + kWorthIt) best = psnr, result.kappa = kappa;
  };
  for (const float kappa : kCoarse) attempt(kappa);
  const float coarse = result.kappa;
  for (const float offset : kRefine) attempt(coarse + offset);
  return result;
}

}  // namespace esvr
