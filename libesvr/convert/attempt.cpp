#include "convert/attempt.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "esvr/grid_coding.h"
#include "esvr/metrics.h"

namespace esvr::convert {
namespace {

constexpr std::uint32_t kShortFitDivisor = 4;  // a full fit has 4 times the iterations

FitOptions optionsFor(const Job& job, std::size_t count, FitLength length) {
  FitOptions options = job.options.fit;
  options.count = count;
  options.psnr.reset();
  options.seconds.reset();
  return length == FitLength::kWhole ? options : shortened(std::move(options));
}

std::size_t within(double count, std::uint64_t voxels) {
  return std::size_t(
      std::clamp(std::floor(count), 1.0, double(std::max<std::uint64_t>(voxels, 1))));
}

}  // namespace

Activity voxelActivity(const Job& job) {
  const bool levelSet = job.input.descriptor.gridClass == GridClass::kLevelSet;
  return levelSet ? Activity::kExact : job.options.storage.activity;
}

double psnrOf(const Job& job, const SparseVolume& volume) {
  const CompareOptions options{.box = job.options.fit.box, .peak = {}, .ssim = false};
  return compareVolumes(job.input.source, volume, options).psnrBox;
}

double psnrOf(const Job& job, const StoredGrid& grid) { return psnrOf(job, decodeGrid(grid)); }

FitOptions shortened(FitOptions options) {
  if (options.iterations)
    options.iterations = std::max(*options.iterations / kShortFitDivisor, 1u);
  else
    options.preset = Preset::kDraft;
  return options;
}

Attempt attempt(const Job& job, double count, FitLength length) {
  const SparseVolume& source = job.input.source;
  Attempt result;
  result.asked = within(count, activeVoxelCount(source));
  result.fit = fit(source, optionsFor(job, result.asked, length));
  result.grid = makeStoredGrid(job.input.descriptor, source, std::move(result.fit.field),
                               job.options.storage.activity);
  result.psnr = psnrOf(job, result.grid);
  return result;
}

CompactResult compacted(const Job& job, const Attempt& attempt, const StorageTarget& target) {
  const FitOptions& fit = job.options.fit;
  return compactGrid(attempt.grid, job.input.source,
                     {.loss = target.loss,
                      .psnr = target.psnr,
                      .bytes = target.bytes,
                      .box = fit.box,
                      .device = fit.device});
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
