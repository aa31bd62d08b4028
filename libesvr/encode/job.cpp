#include "encode/job.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "encode/tone.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr::encode {

// ---- What a job says

bool isCancelled(const Job& job) {
  const CancelToken* cancel = job.options.fit.cancel;
  return cancel && cancel->cancelled();
}

const SparseVolume& valuesOf(const Job& job) {
  return job.judge ? job.judge->values() : job.input.source;
}

std::uint64_t filledIn(const Box& box, const ConvertOptions& options) {
  std::uint64_t count = 0;
  const VoxelLayer* const filled = options.filled;
  for (std::size_t b = 0; filled && b < filled->bricks.size(); ++b)
    forEachActive(filled->active[b], [&](int v) {
      count += box.contains(filled->origin + filled->bricks[b] * kBrickSide + voxelLocal(v));
    });
  return count;
}

double boxGain(const SparseVolume& volume, const ConvertOptions& options) {
  const Box box = options.fit.box.value_or(activeBox(volume));
  std::uint64_t active = 0;
  for (std::size_t b = 0; options.fit.box && b < volume.brickCount(); ++b)
    for (int v = 0; v < kBrickVoxels; ++v)
      active += volume.active[b].test(v) && box.contains(volume.brickCorner(b) + voxelLocal(v));
  if (!options.fit.box) active = activeVoxelCount(volume);
  active -= std::min(active, filledIn(box, options));
  const double share = box.volume() / double(std::max<std::uint64_t>(active, 1));
  return 10.0 * std::log10(std::max(share, 1.0));
}

bool isToned(const Job& job) { return job.judge && job.judge->tone().isOn(); }

bool seesPictures(const Job& job) { return job.judge && job.judge->seesPictures(); }

double psnrOf(const Job& job, SparseVolume volume) {
  if (job.judge) return (*job.judge)(std::move(volume)).quality;
  forgiveFilled(job.input.source, job.options.filled, volume);
  return psnrOverBox(job.input.source, volume,
                     {.box = job.options.fit.box, .peak = job.options.fit.peak});
}

double psnrOf(const Job& job, const StoredGrid& grid) {
  return psnrOf(job, decodeGrid(grid, {.memory = memoryOf(job.input.source)}));
}

Representation representationOf(const Job& job) {
  if (job.options.storage.form == Storage::kFloat32) return Representation::kEllipsoids;
  return job.options.representation;
}

// ---- What the effort allows

namespace {

/// A short fit has a quarter of the iterations of a whole one, and at least so many.
constexpr std::uint32_t kLeastShortIterations = 50;
/// Bricks up to which a whole fit on the CPU has all iterations of its preset; larger volumes have fewer in proportion. An
/// iteration takes 5 to 13 us of two cores for each brick of smoke1, aneurism and neuron_m207, before the kernels of the
/// fit took half of the time.
constexpr double kBricksOfWholeFit = 2100.0;
/// The least share of the iterations of its preset that a whole fit has on the CPU, and the bricks up to which it has them.
/// With 52 iterations, and 30 of short fits, the plume of 640 (40,281 bricks) became 623 KB of voxels; with 165 and 50, 20 KB.
constexpr double kLeastWholeShare = 0.11, kBricksInAMinute = 60'000.0;

}  // namespace

double effortFactor(int effort) {
  constexpr double kStep = 1.6;
  return std::pow(kStep, effort - kUsualEffort);
}

Plan planOf(const Job& job) {
  const int effort = job.options.effort;
  const double wanted = plannedIterations(job.options.fit);
  const SparseVolume& fitted = job.averages ? *job.averages : job.input.source;
  const double bricks = double(std::max<std::size_t>(fitted.brickCount(), 1));
  const bool onGpu = job.options.fit.device.kind == DeviceKind::kCuda;
  const double shortest = std::min<double>(kLeastShortIterations, wanted);
  const double inTime = onGpu ? wanted : wanted * kBricksOfWholeFit / bricks;
  const double inAMinute =
      std::max(kLeastWholeShare * wanted, shortest) * std::min(1.0, kBricksInAMinute / bricks);
  const double affordable = std::max(inTime, inAMinute);
  const double most = std::max(effortFactor(effort), 1.0),
               least = std::min(effortFactor(effort), 1.0);
  const double usual = std::min(wanted, most * affordable);
  Plan plan;
  plan.fitsInTime = usual >= shortest;
  plan.wholeIterations = std::uint32_t(std::ceil(std::max({least * usual, shortest, 1.0})));
  plan.shortIterations =
      std::min(plan.wholeIterations,
               std::clamp(plan.wholeIterations / 4, kLeastShortIterations, kMostShortIterations));
  plan.improves = inTime >= inAMinute || effort > kUsualEffort;
  plan.wholeFits = job.options.fit.preset == Preset::kHigh ? 3 : 2;
  plan.probes = job.options.fit.preset == Preset::kHigh;
  return plan;
}

}  // namespace esvr::encode
