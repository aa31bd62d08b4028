#include "fit/paper/paper_run.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "esvr/error.h"
#include "esvr/field.h"
#include "fit/export_field.h"
#include "fit/paper/densify.h"
#include "fit/paper/initial_points.h"
#include "fit/paper/paper_field.h"
#include "fit/paper/prune.h"

namespace esvr::paper {
namespace {

constexpr std::uint32_t kCurvePoints = 64;
constexpr double kLastRate = 0.1;          // learning rates at the end, relative to the start
constexpr double kSmallestScale = 0.05;    // voxels; smaller ellipsoids hardly reach a voxel
constexpr double kFloorShare = 1.0 / 255;  // |I| phi that covers a voxel, in ranges of values

class Epochs {
 public:
  Epochs(PaperOptimiser& optimiser, const PaperRun& run, Recorder& recorder, PaperRecord& record)
      : optimiser_(optimiser),
        run_(run),
        recorder_(recorder),
        record_(record),
        space_(spaceOf(run.target)),
        range_(run.target.highest - run.target.lowest),
        unit_(0.5 * space_.longestAxis()) {}

  FitEnd go() {
    place();
    try {
      return visitEpochs();
    } catch (const Cancelled&) {
      return FitEnd::kCancelled;
    }
  }

 private:
  FitEnd visitEpochs() {
    const PaperMethod& method = run_.method;
    for (std::uint32_t epoch = 1; epoch <= method.epochs; ++epoch) {
      if (recorder_.cancelled()) return FitEnd::kCancelled;
      visitAll(epoch);
      if (densifiesAfter(epoch)) densifyNow(epoch);
      for (const PrunePass& pass : method.prunes)
        if (pass.epoch == epoch) pruneNow(pass);
      if (const auto end = checkEnd(epoch)) return *end;
    }
    return run_.options.psnr ? FitEnd::kPsnrMissed : FitEnd::kScheduleDone;
  }

  void place() {
    Population population;
    population.ellipsoids =
        initialPoints(run_.target, run_.method.points, kindOf(run_.method), run_.options.seed);
    population.states.resize(population.size());
    record_.points = population.size();
    optimiser_.put(population);
    recorder_.record(optimiser_.measure(), population.size(), 0);
  }

  [[nodiscard]] PaperStep stepAt(double fraction) const {
    const PaperRates& rates = run_.method.rates;
    const double decay = std::pow(kLastRate, fraction);
    PaperStep step;
    const double k = run_.method.learnK ? rates.k : 0.0;
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
      optimiser_.iterate(s, stepAt(done / run_.method.epochs));
    }
  }

  [[nodiscard]] bool densifiesAfter(std::uint32_t epoch) const {
    const PaperMethod& m = run_.method;
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
    const auto counts =
        densify(population, {.threshold = run_.method.gradientThreshold,
                             .splitAbove = run_.method.percentDense * unit_,
                             .maxCount = run_.method.maxEllipsoids,
                             .seed = run_.options.seed ^ (std::uint64_t(epoch) << 32)});
    record_.cloned += counts.cloned;
    record_.split += counts.split;
    optimiser_.put(population);
  }

  /// The number of ellipsoids that a pruning pass keeps.
  [[nodiscard]] std::size_t keptBy(const PrunePass& pass, std::size_t count) const {
    if (run_.method.keep && pass.epoch == run_.method.prunes.back().epoch)
      return std::min(*run_.method.keep, count);
    return count - std::size_t(std::llround(pass.share * double(count)));
  }

  void pruneNow(const PrunePass& pass) {
    Population population = optimiser_.population();
    PruneRecord note{pass.epoch, population.size()};
    note.psnrBoxBefore = recordPoint().psnrBox;
    note.hitsBefore = averageHits(fieldOf(population, kindOf(run_.method), {}));
    const auto scores = pruneScores(population.ellipsoids, run_.method.score,
                                    {kindOf(run_.method), space_.voxels(), kFloorShare * range_});
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
    const auto& options = run_.options;
    const std::uint32_t epochs = run_.method.epochs;
    const bool timeUp = options.seconds && recorder_.seconds() >= *options.seconds;
    const bool due = epoch % std::max(1u, epochs / kCurvePoints) == 0 || epoch == epochs;
    if (!due && !timeUp) return std::nullopt;
    const TimedCurvePoint& now = recordPoint();
    recorder_.report(now, double(epoch) / epochs);
    if (options.psnr && now.psnrBox > *options.psnr) return FitEnd::kPsnrReached;
    if (timeUp) return FitEnd::kTimeUp;
    return std::nullopt;
  }

  PaperOptimiser& optimiser_;
  const PaperRun& run_;
  Recorder& recorder_;
  PaperRecord& record_;
  Space space_;
  double range_;  ///< range of the target's values
  double unit_;   ///< half the longest axis, voxels
};

}  // namespace

KernelKind kindOf(const PaperMethod& method) {
  return {method.gaussian, method.learnK && !method.gaussian, method.k};
}

FitEnd runPaper(PaperOptimiser& optimiser, const PaperRun& run, Recorder& recorder,
                PaperRecord& record) {
  return Epochs(optimiser, run, recorder, record).go();
}

}  // namespace esvr::paper
