// Single fits of a search: the fit, its grid in float32 and in the form that is stored, and their quality.

#include "encode/attempt.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "encode/tone.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "esvr/resolution.h"
#include "format/section_table.h"

namespace esvr::encode {

namespace {

/// Share of the active voxels with an extreme value from which on a volume saturates.
constexpr double kSaturatedShare = 0.05;

}  // namespace

bool saturates(const SparseVolume& volume) {
  const ValueRange range = activeRange(volume);
  const auto isExtreme = [&](float v) {
    return (v == range.max && v > volume.background) || (v == range.min && v < volume.background);
  };
  using Range = tbb::blocked_range<std::size_t>;
  const auto extreme = parallelReduce(
      Range(0, volume.brickCount()), std::uint64_t{0},
      [&](const Range& bricks, std::uint64_t count) {
        for (std::size_t b = bricks.begin(); b != bricks.end(); ++b)
          for (int v = 0; v < kBrickVoxels; ++v)
            count += isExtreme(volume.brickValues(b)[std::size_t(v)]) && volume.active[b].test(v);
        return count;
      },
      std::plus<>());
  return double(extreme) >= kSaturatedShare * double(activeVoxelCount(volume));
}

// ---- The stored grid of a fit

double lastPsnr(const FitResult& fit) { return fit.curve.empty() ? 0.0 : fit.curve.back().psnrBox; }

namespace {

/// Rows for the errors of the layers of a judged grid, which are measured when everything else is done
/// (measureLayers). Their bytes count before.
void reserveLayerErrors(const Job& job, StoredGrid& grid) {
  if (!job.judge) return;
  const std::size_t layers = layerCount(grid);
  grid.layerErrors.assign(layers > 1 ? layers : 0, {});
}

}  // namespace

CompactResult roundedBy(const Job& job, const StoredGrid& grid, const FitResult& fit,
                        CompactOptions target,
                        const std::function<CompactResult(const CompactOptions&)>& round) {
  const FitOptions& wanted = job.options.fit;
  if (job.judge) target.layerErrors = false;
  target.box = wanted.box;
  target.peak = wanted.peak;
  target.device = fit.chunks > 1 ? Device{} : wanted.device;
  auto found = unlessCancelled([&]() -> std::optional<CompactResult> {
    if (fit.end == FitEnd::kCancelled) return std::nullopt;
    return round(target);
  });
  if (!found) {
    const BestSoFar completion;
    target.quick = true;
    found = compactGrid(grid, job.input.source, target);
  }
  reserveLayerErrors(job, found->grid);
  return std::move(*found);
}

CompactResult compactedTo(const Job& job, const StoredGrid& grid, const FitResult& fit,
                          const CompactOptions& target) {
  return roundedBy(job, grid, fit, target, [&](const CompactOptions& options) {
    return compactGrid(grid, job.input.source, options);
  });
}

Conversion conversionOf(FitResult fit, CompactResult compact) {
  Conversion conversion;
  conversion.grid = std::move(compact.grid);
  conversion.fit = std::move(fit);
  conversion.compact = CompactRecord{compact.loss, compact.steps};
  return conversion;
}

StoredGrid storedGridOf(const Job& job, FitResult& fit) {
  const auto made = [&](Activity activity) {
    return makeStoredGrid(job.input.descriptor, job.input.source, fit.field, activity);
  };
  const Activity wanted = job.options.storage.activity;
  auto grid = unlessCancelled([&]() -> std::optional<StoredGrid> {
    if (fit.end == FitEnd::kCancelled) return std::nullopt;
    return made(wanted);
  });
  if (!grid) {
    const BestSoFar completion;
    fit.end = FitEnd::kCancelled;
    grid = made(wanted);
  }
  fit.field = {};
  return std::move(*grid);
}

Conversion storedAs(const Job& job, FitResult fit, StoredGrid grid, const CompactOptions& target) {
  if (job.options.storage.form == Storage::kFloat32) {
    Conversion conversion;
    conversion.fit = std::move(fit);
    conversion.grid = std::move(grid);
    return conversion;
  }
  CompactResult compact = compactedTo(job, grid, fit, target);
  return conversionOf(std::move(fit), std::move(compact));
}

double psnrOf(const Job& job, const Conversion& conversion) {
  const auto measured = unlessCancelled([&]() -> std::optional<double> {
    if (isCancelled(job)) return std::nullopt;
    return psnrOf(job, conversion.grid);
  });
  if (measured) return *measured;
  return lastPsnr(conversion.fit) - (conversion.compact ? conversion.compact->loss : 0.0);
}

std::uint64_t bytesOfEllipsoids(const StoredGrid& grid) {
  const BestSoFar completion;
  return bytesAdded(grid);
}

std::uint64_t paddingOf(const CompactResult& made) {
  return made.grid.field.chunks.size() * (format::kAlignment - 1);
}

// ---- Fits

FitOptions optionsFor(const Job& job, double count, std::uint32_t iterations) {
  FitOptions options = job.options.fit;
  const double most = double(std::max<std::uint64_t>(activeVoxelCount(job.input.source), 1));
  options.count = std::size_t(std::clamp(std::floor(count), 1.0, most));
  options.psnr.reset();
  options.seconds.reset();
  options.iterations = iterations;
  return options;
}

namespace {

/// A fit to the input of a job, or to its averages. Its field and that of options.start are among the voxels of the input.
FitResult fitted(const Job& job, FitOptions options) {
  if (!job.averages) return fit(job.input.source, options);
  Field start;
  if (options.start) start = amongOtherVoxels(*options.start, kAveraged), options.start = &start;
  if (!options.peak) options.peak = peakOf(job.input.source);
  FitResult made = fit(*job.averages, options);
  made.field = amongOtherVoxels(std::move(made.field), 1.0 / kAveraged);
  return made;
}

}  // namespace

Attempt attempted(const Job& job, const FitOptions& options) {
  Attempt result;
  result.asked = *options.count;
  result.fit = fitted(job, options);
  result.grid = storedGridOf(job, result.fit);
  const SparseVolume& source = job.input.source;
  const auto judged = unlessCancelled([&]() -> std::optional<Judge::Judgement> {
    if (result.cancelled()) return std::nullopt;
    SparseVolume decoded = decodeGrid(result.grid, {.memory = memoryOf(source)});
    if (job.averages)
      result.psnrOfVoxels =
          psnrOverBox(source, decoded, {.peak = options.peak ? *options.peak : peakOf(source)});
    if (!job.judge) return Judge::Judgement{psnrOf(job, std::move(decoded))};
    return (*job.judge)(std::move(decoded));
  });
  if (!judged) result.fit.end = FitEnd::kCancelled;
  result.psnr = judged ? judged->quality : lastPsnr(result.fit);
  result.forTones = judged ? judged->forTones : 0.0;
  return result;
}

Attempt shortFitOf(const Job& job, double count) {
  return attempted(job, optionsFor(job, count, planOf(job).shortIterations));
}

}  // namespace esvr::encode
