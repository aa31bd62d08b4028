#include "convert/preset.h"

#include <algorithm>
#include <cmath>

#include "convert/choice.h"
#include "convert/exact_voxels.h"

namespace esvr::convert {
namespace {

/// Active voxels per ellipsoid at the largest number of ellipsoids. With more of them, voxels take
/// fewer bytes.
constexpr double kMinVoxelsPerEllipsoid = 8.0;

/// Bricks up to which a fit on the CPU has all iterations of its preset; larger volumes have fewer in
/// proportion. An iteration takes 5 to 13 us of two cores for each brick of smoke1, aneurism and
/// neuron_m207, so that a fit takes 15 to 40 seconds at most.
constexpr double kBricksOfWholeFit = 2100.0;

/// Bytes of a grid at which nothing is tried to save some of them. A fit would take seconds.
constexpr std::uint64_t kSmallEnough = 8192;

/// Share of the bytes of voxels that ellipsoids must be expected to stay below: full fits, which
/// take most of the time, are made only if they save something.
constexpr double kWorthwhileShare = 0.85;

std::uint64_t activeVoxelsIn(const SparseVolume& volume, const Box& box) {
  std::uint64_t count = 0;
  for (std::size_t b = 0; b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      if (volume.active[b].test(v) && box.contains(volume.brickCorner(b) + voxelLocal(v))) ++count;
  return count;
}

/// The PSNR over the box at which the same sum of squares has a PSNR over the active voxels.
double boxPsnrFor(const Job& job, double psnrActive) {
  const SparseVolume& source = job.input.source;
  const Box box = job.options.fit.box.value_or(activeBox(source));
  const auto active = std::max<std::uint64_t>(activeVoxelsIn(source, box), 1);
  return psnrActive + 10.0 * std::log10(std::max(box.volume() / double(active), 1.0));
}

/// Bounds the number of ellipsoids and, on the CPU, the iterations. Fits of a large volume keep all
/// iterations: with a few hundredths of them, ellipsoids would not reach the PSNR.
FitOptions bounded(const Job& job) {
  const SparseVolume& volume = job.input.source;
  FitOptions options = job.options.fit;
  const auto activeVoxels = double(activeVoxelCount(volume));
  options.count = std::max<std::size_t>(std::size_t(activeVoxels / kMinVoxelsPerEllipsoid), 1);
  if (options.device.kind == DeviceKind::kCuda || isLarge(job)) return options;
  const double share =
      std::min(1.0, kBricksOfWholeFit / double(std::max<std::size_t>(volume.brickCount(), 1)));
  options.iterations = std::uint32_t(std::ceil(share * plannedIterations(options)));
  return options;
}

}  // namespace

Conversion convertToPreset(const Job& job, const PresetGoal& goal,
                           const std::function<Conversion()>& fit) {
  const bool mayFit = job.options.representation != Representation::kVoxels;
  if (isLarge(job) && mayFit && !goal.steady) return fit();
  ConvertOptions options = job.options;
  options.fit = bounded(job);
  const double psnr = boxPsnrFor(job, presetPsnr(job.options.fit.preset));
  return convertToPsnr({job.input, options, job.limits}, {psnr, kSmallEnough, kWorthwhileShare});
}

}  // namespace esvr::convert
