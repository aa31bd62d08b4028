#include "esvr/paper_method.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "esvr/error.h"
#include "esvr/field.h"
#include "fit/empty_fit.h"
#include "fit/paper/paper_field.h"
#include "fit/paper/paper_run.h"

namespace esvr::paper {
namespace {

void requireOption(bool holds, const std::string& otherwise) {
  if (!holds) throw UsageError("the paper's method: " + otherwise);
}

void checkPrunes(const PaperMethod& method) {
  std::uint32_t last = 0;
  for (const PrunePass& pass : method.prunes) {
    requireOption(pass.share >= 0.0 && pass.share < 1.0, "a pass must leave some ellipsoids");
    requireOption(pass.epoch > last, "pruning passes must be in order, from epoch 1 on");
    last = pass.epoch;
  }
}

/// Applies CommonFitOptions::count: the number that the last pruning pass keeps, or, without
/// pruning, the largest number of ellipsoids.
PaperMethod methodFor(const PaperFitOptions& options) {
  PaperMethod method = options.method;
  if (!options.count) return method;
  if (!method.prunes.empty())
    method.keep = options.count;
  else
    method.maxEllipsoids = *options.count;
  return method;
}

PaperOptions optimiserOptions(const PaperFitOptions& options, int side) {
  const PaperMethod& method = options.method;
  return {kindOf(method), method.beta, side, options.device, options.maxDeviceBytes};
}

PaperRecord newRecord(const FitTarget& target, const PaperFitOptions& options) {
  PaperRecord record;
  record.method = methodFor(options);
  record.subvolumeSide = subvolumeSide(spaceOf(target), record.method.subvolume);
  return record;
}

void checkMethod(const PaperMethod& m) {
  requireOption(m.beta >= 0.0 && m.beta <= 1.0, "beta must be within 0 and 1");
  requireOption(m.k >= kSmallestK && m.k <= 1e4, "k must be from 0.5 to 10000");
  requireOption(m.points > 0 && m.epochs > 0, "it needs points and epochs");
  requireOption(m.subvolume >= 0, "subvolumes have a side of voxels");
  requireOption(m.densifyEvery > 0, "it densifies every so many epochs, at least 1");
  requireOption(m.gradientThreshold >= 0.0 && std::isfinite(m.gradientThreshold),
                "the gradient threshold must be a number from 0 on");
  requireOption(m.percentDense > 0.0 && std::isfinite(m.percentDense),
                "the share of a dense ellipsoid must be a number above 0");
  checkPrunes(m);
}

void check(const PaperFitOptions& options) {
  requireOption(!options.count || *options.count > 0, "count must be at least 1");
  requireOption(!options.seconds || *options.seconds > 0.0, "seconds must be positive");
  requireOption(!options.psnr || std::isfinite(*options.psnr), "psnr must be finite");
  requireOption(!options.box || !options.box->empty(), "the box is empty");
  checkMethod(options.method);
}

bool anyNegative(const Population& population) {
  return std::any_of(population.ellipsoids.begin(), population.ellipsoids.end(),
                     [](const PaperEllipsoid& p) { return p.intensity < 0.0; });
}

FitResult resultOf(const Recorder& recorder, const PaperOptimiser& optimiser, Field field) {
  FitResult result;
  result.field = std::move(field);
  result.curve = recorder.curve();
  result.deviceBytes = optimiser.deviceBytes();
  result.pairs = optimiser.pairCount();
  result.secondsOptimise = recorder.seconds();
  return result;
}

}  // namespace

}  // namespace esvr::paper

namespace esvr {

PaperFitResult fitByPaper(const SparseVolume& volume, const PaperFitOptions& options) {
  using namespace paper;
  check(options);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  const FitTarget target = makeTarget(volume, options.box, options.peak);
  PaperRecord record = newRecord(target, options);
  if (isEmpty(target)) return {emptyFit(volume, Kernel{}.kappa), std::move(record)};
  Recorder recorder(target, options);
  const auto optimiser =
      makePaperOptimiser(target, optimiserOptions(options, record.subvolumeSide));
  record.subvolumes = optimiser->subvolumeCount();
  const FitEnd end = runPaper(*optimiser, {target, record.method, options}, recorder, record);

  const BestSoFar completion;
  const KernelKind kind = kindOf(record.method);
  Population population = optimiser->population();
  dropUnseen(population, kind, spaceOf(target).voxels());
  optimiser->put(population);
  recorder.record(optimiser->measure(), population.size(), record.iterations);
  FitResult fit =
      resultOf(recorder, *optimiser,
               fieldOf(population, kind, {volume.origin, target.scale, volume.background, {}}));
  fit.end = end;
  fit.signedIntensities = anyNegative(population);
  record.hits = averageHits(fit.field);
  return {std::move(fit), std::move(record)};
}

}  // namespace esvr
