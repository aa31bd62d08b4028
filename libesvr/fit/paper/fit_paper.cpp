#include "fit/paper/fit_paper.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"
#include "fit/paper/paper_field.h"
#include "fit/paper/paper_run.h"

namespace esvr::paper {
namespace {

void require(bool holds, const std::string& otherwise) {
  if (!holds) throw UsageError("the paper's method: " + otherwise);
}

void checkPrunes(const PaperMethod& method) {
  std::uint32_t last = 0;
  for (const PrunePass& pass : method.prunes) {
    require(pass.share >= 0.0 && pass.share < 1.0, "a pass must leave some ellipsoids");
    require(pass.epoch > last, "pruning passes must be in order, from epoch 1 on");
    last = pass.epoch;
  }
}

/// --count: what the last pass leaves, or where there is none what may be added.
PaperMethod methodFor(const FitOptions& options) {
  PaperMethod method = *options.paper;
  if (!options.count) return method;
  if (!method.prunes.empty())
    method.keep = options.count;
  else
    method.maxEllipsoids = *options.count;
  return method;
}

PaperOptions optimiserOptions(const FitOptions& options, int side) {
  return {kindOf(*options.paper), options.beta, side, options.device, options.maxDeviceBytes};
}

PaperRecord newRecord(const FitTarget& target, const FitOptions& options) {
  PaperRecord record;
  record.method = methodFor(options);
  record.subvolumeSide = subvolumeSide(spaceOf(target), record.method.subvolume);
  return record;
}

bool anyNegative(const Population& population) {
  return std::any_of(population.ellipsoids.begin(), population.ellipsoids.end(),
                     [](const PaperEllipsoid& p) { return p.intensity < 0.0; });
}

}  // namespace

void checkPaper(const FitOptions& options) {
  const PaperMethod& m = *options.paper;
  require(!options.kappa, "its k takes the place of kappa");
  require(!options.iterations, "it counts epochs, not iterations");
  require(!options.narrowBand, "its loss compares windows, which a narrow band does not fill");
  require(m.k >= kSmallestK && m.k <= 1e4, "k must be from 0.5 to 10000");
  require(m.points > 0 && m.epochs > 0, "it needs points and epochs");
  require(m.subvolume >= 0, "subvolumes have a side of voxels");
  require(m.densifyEvery > 0, "it densifies every so many epochs, at least 1");
  require(m.gradientThreshold >= 0.0 && std::isfinite(m.gradientThreshold),
          "the gradient threshold must be a number from 0 on");
  require(m.percentDense > 0.0 && std::isfinite(m.percentDense),
          "percent-dense must be a number above 0");
  checkPrunes(m);
}

FitResult fitPaper(const SparseVolume& volume, const FitTarget& target, const FitOptions& options) {
  Recorder recorder(target, options);
  FitResult result;
  PaperRecord record = newRecord(target, options);
  const auto optimiser =
      makePaperOptimiser(target, optimiserOptions(options, record.subvolumeSide));
  record.subvolumes = optimiser->subvolumeCount();
  result.end = runPaper(*optimiser, {target, record.method, options}, recorder, record);

  const KernelKind kind = kindOf(record.method);
  Population population = optimiser->population();
  dropUnseen(population, kind, spaceOf(target).voxels());
  optimiser->put(population);
  recorder.record(optimiser->measure(), population.size(), record.iterations);
  result.field = fieldOf(population, kind, {volume.origin, target.scale, volume.background, {}});
  result.curve = recorder.curve();
  result.deviceBytes = optimiser->deviceBytes();
  result.pairs = optimiser->pairCount();
  result.signedIntensities = anyNegative(population);
  result.secondsOptimise = recorder.seconds();
  result.paper = std::move(record);
  return result;
}

}  // namespace esvr::paper
