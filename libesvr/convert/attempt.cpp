#include "convert/attempt.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "convert/unless_cancelled.h"
#include "core/add_seconds.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/activity_sections.h"

namespace esvr::convert {
namespace {

/// Iterations of a short fit: a quarter of a whole one's, and at most these. Tuning::forRun() makes the
/// most of them.
constexpr std::uint32_t kShortFitDivisor = 4, kPilotIterations = 100;
/// A continued fit of fewer ellipsoids starts from this share of them. New ones then find the places
/// that miss those that were dropped.
constexpr double kGrownFrom = 0.9;
/// Share of a whole fit's iterations that a continued fit has.
constexpr double kContinuedShare = 0.4;

std::size_t within(double count, std::uint64_t voxels) {
  return std::size_t(
      std::clamp(std::floor(count), 1.0, double(std::max<std::uint64_t>(voxels, 1))));
}

FitOptions optionsFor(const Job& job, double count, FitLength length) {
  FitOptions options = job.options.fit;
  options.count = within(count, activeVoxelCount(job.input.source));
  options.psnr.reset();
  options.seconds.reset();
  return length == FitLength::kWhole ? options : shortened(std::move(options));
}

/// PSNR of the sum over the box at the end of a fit, as the device of the fit measures it.
double lastPsnr(const FitResult& fit) { return fit.curve.empty() ? 0.0 : fit.curve.back().psnrBox; }

Attempt attempted(const Job& job, const FitOptions& options) {
  Attempt result;
  result.asked = *options.count;
  result.fit = fit(job.input.source, options);
  result.grid = storedGridOf(job, result.fit);
  const auto psnr = unlessCancelled([&]() -> std::optional<double> {
    if (result.cancelled()) return std::nullopt;
    return psnrOf(job, result.grid);
  });
  if (!psnr) result.fit.end = FitEnd::kCancelled;
  result.psnr = psnr.value_or(lastPsnr(result.fit));
  return result;
}

/// dB by which a fit with both signs must be better than one with the signs of the values
/// (docs/lab-notes.md, "Signs").
constexpr double kSignsGain = 0.25;

/// The ellipsoids of a field that add most to it: those with the largest integral of their square.
Field strongest(const Field& field, std::size_t count) {
  struct Strength {
    double strength;
    std::size_t chunk, ellipsoid;
  };
  std::vector<Strength> all;
  for (std::size_t c = 0; c < field.chunks.size(); ++c) {
    const Ellipsoids& e = field.chunks[c].ellipsoids;
    for (std::size_t i = 0; i < e.size(); ++i) {
      const double logVolume = double(e.logScale[0][i]) + e.logScale[1][i] + e.logScale[2][i];
      all.push_back({2.0 * std::log(std::abs(double(e.intensity[i]))) + logVolume, c, i});
    }
  }
  std::ranges::stable_sort(all, std::greater<>(), &Strength::strength);
  all.resize(std::min(count, all.size()));
  const auto place = [](const Strength& s) { return std::pair(s.chunk, s.ellipsoid); };
  std::ranges::sort(all, {}, place);
  Field kept{field.background, field.kernel, {}};
  for (const Chunk& chunk : field.chunks) kept.chunks.push_back({chunk.origin, {}});
  for (const Strength& s : all) {
    const Ellipsoids& from = field.chunks[s.chunk].ellipsoids;
    Ellipsoids& to = kept.chunks[s.chunk].ellipsoids;
    const auto take = [&](const auto& source, auto& target) {
      if (!source.empty()) target.push_back(source[s.ellipsoid]);
    };
    for (std::size_t a = 0; a < 3; ++a) take(from.center[a], to.center[a]);
    for (std::size_t a = 0; a < 3; ++a) take(from.logScale[a], to.logScale[a]);
    for (std::size_t a = 0; a < 4; ++a) take(from.rotation[a], to.rotation[a]);
    take(from.intensity, to.intensity);
    take(from.kappa, to.kappa);
  }
  return kept;
}

/// The PSNR of an attempt if it is quantised to as many bytes as others. Terms that cancel each
/// other need more bits, so that the PSNR alone would not do.
double psnrForItsBytes(const Job& job, const Attempt& attempt) {
  const CompactResult compact = compacted(job, attempt, {});
  const double doublings = std::log2(double(std::max<std::uint64_t>(compact.bytes, 1)));
  return attempt.psnr - compact.loss - kDbPerDoubling * doublings;
}

/// A short fit with both signs if it is better than `own`, which has the signs of the values.
std::optional<Attempt> betterSigned(const Job& job, double count, const Attempt& own) {
  ConvertOptions both = job.options;
  both.fit.bothSigns = true;
  Attempt found = attempt({job.input, both}, count, FitLength::kShort);
  if (psnrForItsBytes(job, found) < psnrForItsBytes(job, own) + kSignsGain) return std::nullopt;
  return found;
}

/// Largest share of a size that a mask, or the thresholds of blocks, may take.
constexpr double kMaxActivityShare = 0.25;
/// Error of the values for which the bytes of a mask are measured, as a share of their peak: 40 dB.
constexpr double kErrorOfMask = 0.01;

/// Bytes of the section of a simplified mask.
std::uint64_t maskBytes(const Job& job) {
  const SparseVolume& source = job.input.source;
  const SimplifiedMasks own(source);
  const SimplifiedMasks& kept = job.input.simplified ? *job.input.simplified : own;
  const auto masks = kept.forError(kErrorOfMask * job.options.fit.peak.value_or(peakOf(source)));
  std::vector<Coord> corners;
  for (std::size_t b = 0; b < masks.size(); ++b) corners.push_back(source.brickCorner(b));
  return format::putMask(corners, masks).size();
}

/// Share of the active voxels with the largest or the smallest value of the volume, other than the
/// background, from which on it saturates.
constexpr double kSaturatedShare = 0.05;

}  // namespace

bool saturates(const SparseVolume& volume) {
  const ValueRange range = activeRange(volume);
  const auto isExtreme = [&](float v) {
    return (v == range.max && v > volume.background) || (v == range.min && v < volume.background);
  };
  std::uint64_t extreme = 0;
  for (std::size_t i = 0; i < volume.values.size(); ++i)
    extreme +=
        isExtreme(volume.values[i]) && volume.active[i / kBrickVoxels].test(int(i % kBrickVoxels));
  return double(extreme) >= kSaturatedShare * double(activeVoxelCount(volume));
}

double shortFitBehind(const SparseVolume& volume) {
  // smoke1 and wdas have 1.3 to 1.6. Volumes that saturate have 5 to 6 (dragon, aneurism), since a
  // clamped voxel has no gradient.
  constexpr double kUsual = 1.6, kSaturated = 5.0;
  return saturates(volume) ? kSaturated : kUsual;
}

ActivityOptions activityOf(const Job& job) {
  return {job.options.storage.activity, job.input.simplified};
}

Activity voxelActivity(const Job& job) {
  const bool levelSet = job.input.descriptor.gridClass == GridClass::kLevelSet;
  return levelSet ? Activity::kExact : job.options.storage.activity;
}

Activity activityForSize(const Job& job, std::uint64_t bytes) {
  const Activity wanted = job.options.storage.activity;
  if (wanted != Activity::kAuto || job.options.fit.narrowBand) return wanted;
  return kMaxActivityShare * double(bytes) < double(maskBytes(job)) ? Activity::kNoMask : wanted;
}

bool levelsTakeTooMuch(const StoredGrid& grid, std::uint64_t bytes) {
  if (grid.topology != TopologyKind::kBlocks) return false;
  const std::size_t levels = format::putLevels({grid.bricks, grid.levels}).size();
  return kMaxActivityShare * double(bytes) < double(levels);
}

RoundedSigns voxelSigns(const Job& job) {
  return job.options.fit.narrowBand ? RoundedSigns::kKept : RoundedSigns::kMayChange;
}

DecodedValues decodedValues(const Job& job) {
  return job.input.descriptor.valueType == ValueType::kHalf ? DecodedValues::kHalfs
                                                            : DecodedValues::kFloats;
}

double psnrOf(const Job& job, const SparseVolume& volume) {
  return psnrOverBox(job.input.source, volume,
                     {.box = job.options.fit.box, .peak = job.options.fit.peak});
}

double psnrOf(const Job& job, const StoredGrid& grid) {
  return psnrOf(job, decodeGrid(grid, {.memory = memoryOf(job.input.source)}));
}

FitOptions shortened(FitOptions options) {
  options.iterations =
      std::clamp(plannedIterations(options) / kShortFitDivisor, 1u, kPilotIterations);
  return options;
}

Attempt attempt(const Job& job, double count, FitLength length) {
  return attempted(job, optionsFor(job, count, length));
}

bool canContinue(const Attempt& from, double count) {
  constexpr double kLeastGrowth = 0.85, kMostGrowth = 1.5;
  const double growth = count / double(std::max<std::size_t>(from.count(), 1));
  return !from.cancelled() && growth >= kLeastGrowth && growth <= kMostGrowth;
}

Attempt continued(const Job& job, const Attempt& from, double count) {
  FitOptions options = optionsFor(job, count, FitLength::kWhole);
  options.iterations =
      std::max(std::uint32_t(kContinuedShare * double(plannedIterations(options))), 1u);
  const bool grows = *options.count >= from.count();
  const Field start =
      grows ? Field{}
            : strongest(from.grid.field, std::size_t(kGrownFrom * double(*options.count)));
  options.start = grows ? &from.grid.field : &start;
  return attempted(job, options);
}

Attempt withBetterSigns(const ConvertInput& input, Attempt own, ConvertOptions& options) {
  const Job job{input, options};
  const FitOptions& fit = options.fit;
  if (own.cancelled() || fit.bothSigns || fit.narrowBand || !saturates(input.source)) return own;
  double seconds = 0.0;
  // If these fits are cancelled, the search continues with `own` and marks it as cancelled.
  auto found = addSeconds(seconds, [&] {
    return unlessCancelled([&] { return betterSigned(job, double(own.asked), own); });
  });
  options.fit.bothSigns = found.has_value();
  Attempt& best = found ? *found : own;
  best.bothSigns = {.tried = true, .used = found.has_value(), .seconds = seconds};
  if (fit.cancel && fit.cancel->cancelled()) best.fit.end = FitEnd::kCancelled;
  return std::move(best);
}

bool isCancelled(const Job& job) {
  const CancelToken* cancel = job.options.fit.cancel;
  return cancel && cancel->cancelled();
}

StoredGrid storedGridOf(const Job& job, FitResult& fit) {
  const auto made = [&](const ActivityOptions& activity) {
    return makeStoredGrid(job.input.descriptor, job.input.source, fit.field, activity);
  };
  ActivityOptions activity = activityOf(job);
  auto grid = unlessCancelled([&]() -> std::optional<StoredGrid> {
    if (fit.end == FitEnd::kCancelled) return std::nullopt;
    return made(activity);
  });
  if (!grid) {
    const BestSoFar completion;
    fit.end = FitEnd::kCancelled;
    if (activity.activity != Activity::kExact) activity.activity = Activity::kByValue;
    grid = made(activity);
  }
  fit.field = {};
  return std::move(*grid);
}

std::uint64_t bytesOfEllipsoids(const StoredGrid& grid) {
  const BestSoFar completion;
  return bytesAdded(grid);
}

CompactResult compacted(const Job& job, const StoredGrid& grid, const FitResult& fit,
                        const StorageTarget& target) {
  const FitOptions& wanted = job.options.fit;
  CompactOptions options{.loss = target.loss,
                         .psnr = target.psnr,
                         .bytes = target.bytes,
                         .box = wanted.box,
                         .peak = wanted.peak,
                         .device = rateControlDevice(fit, wanted.device),
                         .activity = activityOf(job)};
  auto found = unlessCancelled([&]() -> std::optional<CompactResult> {
    if (fit.end == FitEnd::kCancelled) return std::nullopt;
    return compactGrid(grid, job.input.source, options);
  });
  if (found) return std::move(*found);
  const BestSoFar completion;
  options.quick = true;
  return compactGrid(grid, job.input.source, options);
}

CompactResult compacted(const Job& job, const Attempt& attempt, const StorageTarget& target) {
  return compacted(job, attempt.grid, attempt.fit, target);
}

double psnrOf(const Job& job, const Conversion& conversion) {
  const auto measured = unlessCancelled([&]() -> std::optional<double> {
    if (isCancelled(job)) return std::nullopt;
    return psnrOf(job, conversion.grid);
  });
  if (measured) return *measured;
  return lastPsnr(conversion.fit) - (conversion.compact ? conversion.compact->loss : 0.0);
}

Device rateControlDevice(const FitResult& fit, const Device& device) {
  return fit.chunks > 1 ? Device{} : device;
}

double priceOf(const Attempt& attempt, const CompactResult& compact) {
  const double count = double(std::max<std::size_t>(attempt.count(), 1));
  return std::max(double(compact.bytes) / count, 1.0);
}

Conversion conversionOf(FitResult fit, CompactResult compact) {
  Conversion conversion;
  conversion.grid = std::move(compact.grid);
  conversion.fit = std::move(fit);
  conversion.compact = CompactRecord{compact.loss, compact.steps};
  return conversion;
}

Conversion conversionOf(Attempt attempt) {
  Conversion conversion;
  conversion.grid = std::move(attempt.grid);
  conversion.fit = std::move(attempt.fit);
  return conversion;
}

}  // namespace esvr::convert
