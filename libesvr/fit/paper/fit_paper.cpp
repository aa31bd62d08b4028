// The paper's algorithm: epochs, densification and pruning (appendix, 'Structure-aware ellipsoid
// learning').

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "esvr/paper_method.h"
#include "fit/paper/paper_optimiser.h"
#include "fit/paper/population.h"
#include "fit/run.h"

namespace esvr {

PaperMethod scaledTo(const PaperMethod& method, std::uint32_t epochs) {
  const double factor = double(epochs) / double(method.epochs);
  const auto scaled = [&](std::uint32_t epoch) {
    return std::uint32_t(std::max(1.0, std::round(double(epoch) * factor)));
  };
  PaperMethod result = method;
  result.epochs = epochs;
  result.densifyFrom = scaled(method.densifyFrom);
  result.densifyUntil = scaled(method.densifyUntil);
  result.densifyEvery = scaled(method.densifyEvery);
  for (PrunePass& pass : result.prunes) pass.epoch = scaled(pass.epoch);
  return result;
}

PaperMethod withThreePasses(PaperMethod method) {
  method.epochs = 1600;
  method.prunes = {{200, 0.8}, {300, 0.8}, {800, 0.85}};
  return method;
}

namespace paper {
namespace {

// --- The options.

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

KernelKind kindOf(const PaperMethod& method) {
  return {method.gaussian, method.learnK && !method.gaussian, method.k};
}

// --- The epochs.

constexpr std::uint32_t kCurvePoints = 64;
constexpr double kLastRate = 0.1;          // learning rates at the end, relative to the start
constexpr double kSmallestScale = 0.05;    // voxels; smaller ellipsoids hardly reach a voxel
constexpr double kFloorShare = 1.0 / 255;  // |I| phi that covers a voxel, in ranges of values

class Epochs {
 public:
  /// The options' seed, psnr and seconds are used. \param record  output: the outcome of the run
  Epochs(PaperOptimiser& optimiser, const FitTarget& target, const PaperFitOptions& options,
         Recorder& recorder, PaperRecord& record)
      : optimiser_(optimiser),
        target_(target),
        method_(record.method),
        options_(options),
        recorder_(recorder),
        record_(record),
        kind_(kindOf(record.method)),
        space_(spaceOf(target)),
        range_(target.highest - target.lowest),
        unit_(0.5 * space_.longestAxis()) {}

  /// Places the first ellipsoids and runs all epochs.
  FitEnd run() {
    place();
    try {
      return visitEpochs();
    } catch (const Cancelled&) {
      return FitEnd::kCancelled;
    }
  }

 private:
  FitEnd visitEpochs() {
    for (std::uint32_t epoch = 1; epoch <= method_.epochs; ++epoch) {
      if (recorder_.cancelled()) return FitEnd::kCancelled;
      visitAll(epoch);
      if (densifiesAfter(epoch)) densifyNow(epoch);
      for (const PrunePass& pass : method_.prunes)
        if (pass.epoch == epoch) pruneNow(pass);
      if (const auto end = checkEnd(epoch)) return *end;
    }
    return options_.psnr ? FitEnd::kPsnrMissed : FitEnd::kScheduleDone;
  }

  void place() {
    Population population;
    population.ellipsoids = initialPoints(target_, method_.points, kind_, options_.seed);
    population.states.resize(population.size());
    record_.points = population.size();
    optimiser_.put(population);
    recorder_.record(optimiser_.measure(), population.size(), 0);
  }

  [[nodiscard]] PaperStep stepAt(double fraction) const {
    const PaperRates& rates = method_.rates;
    const double decay = std::pow(kLastRate, fraction);
    PaperStep step;
    const double k = method_.learnK ? rates.k : 0.0;
    step.rates = {rates.position * unit_,
                  rates.position * unit_,
                  rates.position * unit_,
                  rates.scale,
                  rates.scale,
                  rates.scale,
                  rates.rotation,
                  rates.rotation,
                  rates.rotation,
                  rates.rotation,
                  rates.intensity * range_,
                  k};
    for (double& rate : step.rates) rate *= decay;
    step.positionUnit = unit_;
    step.correct1 = 1.0 / (1.0 - std::pow(kBeta1, record_.iterations));
    step.correct2 = 1.0 / (1.0 - std::pow(kBeta2, record_.iterations));
    step.smallestLogScale = std::log(kSmallestScale);
    step.largestLogScale = std::log(unit_);
    return step;
  }

  void visitAll(std::uint32_t epoch) {
    const auto parts = optimiser_.subvolumeCount();
    for (std::size_t s = 0; s < parts; ++s) {
      CancelScope::check();
      ++record_.iterations;
      const double done = double(epoch - 1) + double(s) / double(parts);
      optimiser_.iterate(s, stepAt(done / method_.epochs));
    }
  }

  [[nodiscard]] bool densifiesAfter(std::uint32_t epoch) const {
    const PaperMethod& m = method_;
    return m.densify && epoch >= m.densifyFrom && epoch <= m.densifyUntil &&
           (epoch - m.densifyFrom) % m.densifyEvery == 0;
  }

  void noteFirstGradient(const Population& population) {
    if (record_.firstGradient > 0.0 || population.size() == 0) return;
    std::vector<double> gradients;
    for (const PaperState& state : population.states) gradients.push_back(meanGradient(state));
    const auto middle = gradients.begin() + std::ptrdiff_t(gradients.size() / 2);
    std::nth_element(gradients.begin(), middle, gradients.end());
    record_.firstGradient = *middle;
  }

  void densifyNow(std::uint32_t epoch) {
    Population population = optimiser_.population();
    noteFirstGradient(population);
    const auto counts = densify(population, {.threshold = method_.gradientThreshold,
                                             .splitAbove = method_.percentDense * unit_,
                                             .maxCount = method_.maxEllipsoids,
                                             .seed = options_.seed ^ (std::uint64_t(epoch) << 32)});
    record_.cloned += counts.cloned;
    record_.split += counts.split;
    optimiser_.put(population);
  }

  /// The number of ellipsoids that a pruning pass keeps.
  [[nodiscard]] std::size_t keptBy(const PrunePass& pass, std::size_t count) const {
    if (method_.keep && pass.epoch == method_.prunes.back().epoch)
      return std::min(*method_.keep, count);
    return count - std::size_t(std::llround(pass.share * double(count)));
  }

  void pruneNow(const PrunePass& pass) {
    Population population = optimiser_.population();
    PruneRecord note{pass.epoch, population.size()};
    note.psnrBoxBefore = recordPoint().psnrBox;
    note.hitsBefore = averageHits(fieldOf(population, kindOf(method_), {}));
    const auto scores = pruneScores(population.ellipsoids, method_.score,
                                    {kind_, space_.voxels(), kFloorShare * range_});
    keepHighest(population, scores, keptBy(pass, population.size()));
    optimiser_.put(population);
    note.after = population.size();
    note.psnrBoxAfter = recordPoint().psnrBox;
    record_.prunes.push_back(note);
  }

  const TimedCurvePoint& recordPoint() {
    return recorder_.record(optimiser_.measure(), optimiser_.ellipsoidCount(), record_.iterations);
  }

  /// Checks the time limit after every epoch, and the error after some epochs.
  [[nodiscard]] std::optional<FitEnd> checkEnd(std::uint32_t epoch) {
    const std::uint32_t epochs = method_.epochs;
    const bool timeUp = options_.seconds && recorder_.seconds() >= *options_.seconds;
    const bool due = epoch % std::max(1u, epochs / kCurvePoints) == 0 || epoch == epochs;
    if (!due && !timeUp) return std::nullopt;
    const TimedCurvePoint& now = recordPoint();
    recorder_.report(now, double(epoch) / epochs);
    if (options_.psnr && now.psnrBox > *options_.psnr) return FitEnd::kPsnrReached;
    if (timeUp) return FitEnd::kTimeUp;
    return std::nullopt;
  }

  PaperOptimiser& optimiser_;
  const FitTarget& target_;
  const PaperMethod& method_;
  const PaperFitOptions& options_;
  Recorder& recorder_;
  PaperRecord& record_;
  KernelKind kind_;
  Space space_;
  double range_;  ///< range of the target's values
  double unit_;   ///< half the longest axis, voxels
};

}  // namespace

}  // namespace paper

PaperFitResult fitByPaper(const SparseVolume& volume, const PaperFitOptions& options) {
  using namespace paper;
  check(options);
  const CancelScope scope(CancelScope::orToken(options.cancel));
  const FitTarget target = makeTarget(volume, options.box, options.peak);
  const Space space = spaceOf(target);
  PaperRecord record;
  record.method = methodFor(options);
  record.subvolumeSide = subvolumeSide(space, record.method.subvolume);
  if (target.empty()) return {emptyFit(volume, Kernel{}.kappa), std::move(record)};
  Recorder recorder(target, options);
  const KernelKind kind = kindOf(record.method);
  const auto optimiser = makePaperOptimiser(target, {kind, record.method.beta, record.subvolumeSide,
                                                     options.device, options.maxDeviceBytes});
  record.subvolumes = optimiser->subvolumeCount();
  const FitEnd end = Epochs(*optimiser, target, options, recorder, record).run();

  const BestSoFar completion;
  Population population = optimiser->population();
  dropUnseen(population, kind, space.voxels());
  optimiser->put(population);
  recorder.record(optimiser->measure(), population.size(), record.iterations);
  FitResult fit;
  fit.field = fieldOf(population, kind, {volume.origin, target.scale, volume.background, {}});
  fit.curve = recorder.curve();
  fit.end = end;
  fit.deviceBytes = optimiser->deviceBytes();
  fit.pairs = optimiser->pairCount();
  fit.secondsOptimise = recorder.seconds();
  fit.signedIntensities = std::ranges::any_of(
      population.ellipsoids, [](const PaperEllipsoid& p) { return p.intensity < 0.0; });
  record.hits = averageHits(fit.field);
  return {std::move(fit), std::move(record)};
}

}  // namespace esvr
