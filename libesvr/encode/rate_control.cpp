// Rate control: compacts a fitted grid. The chapter has three parts: trials with given steps, the search for the steps, and
// compactGrid().

#include "encode/rate_control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "encode/job.h"
#include "encode/root_search.h"
#include "esvr/encode.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/grid_coding.h"
#include "esvr/metrics.h"
#include "format/ellipsoid_sections.h"
#include "format/grid_rule.h"

namespace esvr::encode {

// ---- Trials with given steps

namespace {

/// PSNR, dB, above which a loss by quantising does not matter.
constexpr double kNegligiblePsnr = 110.0;

/// Iterations of the solver: for the float32 shapes, and for rounded shapes, which start from the intensities of the
/// float32 ones. Further iterations would change the error of a trial by a thousandth (docs/lab-notes.md, "Number of
/// trials").
constexpr int kFirstIterations = 8, kIterations = 3;

/// A sample takes one of kCubesPerSample cubes of 4^3 bricks. Smaller volumes are not sampled.
constexpr std::int32_t kCubesPerSample = 4;
constexpr int kCubeSideLog2 = 2;  // in bricks
constexpr std::size_t kMinBricksToSample = 1024;

/// A sample of the bricks; empty if there are too few bricks.
std::vector<Coord> sampleOfCorners(std::vector<Coord> corners) {
  if (corners.size() < kMinBricksToSample) return {};
  std::erase_if(corners, [](Coord corner) {
    const Coord brick = brickOf(corner);
    const std::int32_t cube =
        (brick.x >> kCubeSideLog2) + (brick.y >> kCubeSideLog2) + (brick.z >> kCubeSideLog2);
    return (cube & (kCubesPerSample - 1)) != 0;
  });
  return corners;
}

std::vector<std::vector<double>> splitByChunk(const Field& field, const std::vector<double>& all) {
  std::vector<std::vector<double>> result;
  auto at = all.begin();
  for (const auto& chunk : field.chunks) {
    const auto end = at + std::ptrdiff_t(chunk.ellipsoids.size());
    result.emplace_back(at, end);
    at = end;
  }
  return result;
}

/// Quantises new intensities of a trial and dequantises its field.
/// \param intensities  intensities of all chunks, in the file's order
void storeIntensities(std::span<const float> intensities, RateTrial& trial) {
  for (std::size_t c = 0; c < trial.quantised.size(); ++c) {
    QuantisedEllipsoids& q = trial.quantised[c];
    quantiseIntensities(intensities.first(q.size()), q);
    intensities = intensities.subspan(q.size());
    trial.field.chunks[c].ellipsoids = dequantise(q);
  }
}

/// Solves for the intensities with the shapes of the trial's field, and rounds them.
void solveIntensities(IntensityProblem& problem, RateTrial& trial) {
  problem.setShapes(trial.field);
  const auto before = intensitiesOf(trial.field);
  auto intensities = before;
  const double least = problem.step(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
  if (trial.error <= least) return;
  intensities = before;  // the solver may find a shorter step that reduces the error
  (void)problem.solve(intensities, kIterations);
  storeIntensities(intensities, trial);
  trial.error = problem.error(intensitiesOf(trial.field)).squares;
}

/// The intensities of a trial's first layers; those of the other layers are zero.
std::vector<float> intensitiesOfFirstLayers(const RateTrial& trial, std::size_t layers) {
  std::vector<float> all = intensitiesOf(trial.field);
  auto chunk = all.begin();
  for (const auto& q : trial.quantised) {
    const auto end = chunk + std::ptrdiff_t(q.size());
    if (q.layerEnds.size() > layers)
      std::fill(chunk + std::ptrdiff_t(q.layerEnds[layers - 1]), end, 0.0f);
    chunk = end;
  }
  return all;
}

}  // namespace

RateTrials::RateTrials(const StoredGrid& grid, const SparseVolume& source,
                       const CompactOptions& options)
    : bricks_(grid.bricks),
      target_{source, format::ruleOf(grid), options.box.value_or(activeBox(source)), bricks_,
              grid.topology != TopologyKind::kThreshold},
      sampleBricks_(sampleOfCorners(knownCorners(target_))),
      sampleTarget_{source, target_.rule, target_.box, sampleBricks_, true},
      problem_(target_, options.device),
      sampleProblem_(sampleTarget_, options.device),
      field_(grid.field),
      quick_(options.quick),
      peak_(options.peak ? *options.peak : peakOf(source)) {
  if (quick_) {
    auto intensities = intensitiesOf(field_);
    problem_.setShapes(field_);
    error_ = leastError_ = problem_.step(intensities, 0);
  } else {
    solveField();
  }
  curvature_ = splitByChunk(field_, problem_.curvature());
}

/// Gives the field the best intensities, and measures its error before and after.
void RateTrials::solveField() {
  auto intensities = intensitiesOf(field_);
  error_ = errorOf(field_, intensities).squares;
  leastError_ = problem_.solve(intensities, kFirstIterations);
  setIntensities(intensities, field_);
}

double RateTrials::measure(const RateTrial& trial) {
  return errorOf(trial.field, intensitiesOf(trial.field)).squares;
}

StoredError RateTrials::errorOf(const Field& field, std::span<const float> intensities) {
  problem_.setShapes(field);
  return problem_.error(intensities);
}

double RateTrials::squaresOf(double psnr) const {
  return peak_ * peak_ * target_.box.volume() * std::pow(10.0, -psnr / 10.0);
}

double RateTrials::negligibleError() const { return squaresOf(kNegligiblePsnr); }

/// Quantises each chunk. The trial's field then has rounded shapes and its old intensities, in the file's order.
void RateTrials::quantiseChunks(RateTrial& trial) const {
  trial.quantised.resize(field_.chunks.size());
  parallelFor(std::size_t{0}, field_.chunks.size(), [&](std::size_t c) {
    const Ellipsoids& e = field_.chunks[c].ellipsoids;
    std::vector<std::size_t> order;
    trial.quantised[c] = quantise(e, chooseLattice(e, curvature_[c], trial.steps), order);
    Ellipsoids& rounded = trial.field.chunks[c].ellipsoids;
    rounded = dequantise(trial.quantised[c]);
    for (std::size_t i = 0; i < order.size(); ++i) rounded.intensity[i] = e.intensity[order[i]];
  });
}

RateTrial RateTrials::make(const QuantiserSteps& steps) {
  return std::move(make(std::span(&steps, 1)).front());
}

std::vector<RateTrial> RateTrials::sample(std::span<const QuantiserSteps> steps) {
  return make(steps, sampleBricks_.empty() ? problem_ : sampleProblem_);
}

std::vector<RateTrial> RateTrials::make(std::span<const QuantiserSteps> steps,
                                        IntensityProblem& problem) const {
  std::vector<RateTrial> trials(steps.size());
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t k) {
    trials[k] = {steps[k], field_, {}, 0.0, 0};
    quantiseChunks(trials[k]);
  });
  // one after the other, since each solution takes all threads or the GPU
  for (RateTrial& trial : trials) {
    CancelScope::check();
    if (!quick_) {
      solveIntensities(problem, trial);
      continue;
    }
    storeIntensities(intensitiesOf(trial.field), trial);
    trial.error = error_;
  }
  parallelFor(std::size_t{0}, trials.size(), [&](std::size_t k) {
    for (const auto& chunk : trials[k].quantised) trials[k].bytes += format::storedBytes(chunk);
  });
  return trials;
}

std::vector<LayerError> RateTrials::layerErrors(const RateTrial& trial) {
  std::size_t layers = 1;
  for (const auto& chunk : trial.quantised) layers = std::max(layers, chunk.layerEnds.size());
  std::vector<LayerError> errors;
  for (std::size_t k = 1; k <= layers && layers > 1; ++k) {
    const StoredError error = errorOf(trial.field, intensitiesOfFirstLayers(trial, k));
    errors.push_back(
        {float(psnr(error.squares / target_.box.volume(), peak_)), float(error.largest)});
  }
  return errors;
}

// ---- The search for the steps

namespace {

constexpr double kParametersPerEllipsoid = 10.0;

// The numbers below decide how many trials a choice takes (docs/lab-notes.md, "Number of trials") and how much of a limit
// may stay unused. The budget is the error that rounding may add: the allowed error less the error without rounding.

/// Trials before and after the streams are balanced.
constexpr int kFirstTrials = 3, kMaxTrials = 10;
/// Streams are balanced at steps within 0.7 octaves of the goal's; their costs change little there.
constexpr double kBalanceRange = 0.7;
/// Factor of the steps of a probe, which removes half a bit of each parameter of a stream.
constexpr double kProbeFactor = 1.41421356237;
/// Largest factor by which balancing changes the step of one stream.
constexpr double kMaxBalanceFactor = 2.0;
/// Share of the budget that a result must use, and the share that scaling aims at.
constexpr double kSufficientShareOfBudget = 0.93, kAimedShareOfBudget = 0.965;
/// Share of the bytes that a result should use at least, and the share that ends the search.
constexpr double kMinShareOfBytes = 0.985, kSufficientShareOfBytes = 0.994;
/// Octaves between met and missed steps at which a search ends. Errors are not continuous in the steps; 0.07 octaves are a
/// hundredth of the bytes.
constexpr double kErrorBracket = 0.07, kSizeBracket = 0.015;
/// Smallest budget for the first guess, as a share of the allowed error.
constexpr double kMinBudgetShareOfAllowed = 0.02;
/// Share of the rounding error that remains after solving for the intensities.
constexpr double kErrorShareAfterSolve = 0.75;
/// Error that rounding usually adds when bytes are short, as a share of the fit's error.
constexpr double kUsualAddedShareOfError = 0.2;
/// Factor of the first guess if no error may be added; it adds a hundredth of the guess's error.
constexpr double kFinestFactor = 0.1;
/// Octaves around the first guess in which steps are searched.
constexpr double kMostOctaves = 12.0;

constexpr std::array kStreams{&QuantiserSteps::position, &QuantiserSteps::scale,
                              &QuantiserSteps::rotation, &QuantiserSteps::intensity};

QuantiserSteps scaled(QuantiserSteps steps, double factor) {
  for (const auto stream : kStreams) steps.*stream *= factor;
  return steps;
}

/// Equal steps that should add an error. Rounding errors are taken as independent, each with a variance of step^2 / 12.
QuantiserSteps stepsThatAdd(double error, std::size_t ellipsoids) {
  const double roundings = kParametersPerEllipsoid * double(ellipsoids);
  const double step = std::sqrt(12.0 * error / (kErrorShareAfterSolve * roundings));
  return {step, step, step, step};
}

/// The limit that a search keeps to: of the error, or of the bytes. Its figure grows with the fineness of the steps.
struct StepGoal {
  std::optional<std::uint64_t> bytes{};  ///< nothing: the error is limited
  double allowed = 0.0, base = 0.0;      ///< limit of the error, and the error without rounding
  std::size_t ellipsoids = 0;

  [[nodiscard]] double budget() const { return allowed - base; }
  [[nodiscard]] bool met(const RateTrial& trial) const {
    return bytes ? trial.bytes <= *bytes : trial.error <= allowed;
  }
  /// True if a trial that meets the goal uses enough of the limit.
  [[nodiscard]] bool nearlyMissed(const RateTrial& trial) const {
    if (bytes) return double(trial.bytes) >= kSufficientShareOfBytes * double(*bytes);
    return trial.error >= allowed - (1.0 - kSufficientShareOfBudget) * budget();
  }
  /// Compares two trials that both meet the goal or both miss it.
  [[nodiscard]] bool better(const RateTrial& a, const RateTrial& b) const {
    if (!bytes) return met(a) ? a.bytes < b.bytes : a.error < b.error;
    if (!met(a)) return a.bytes < b.bytes;
    const auto fills = [&](const RateTrial& t) {
      return double(t.bytes) >= kMinShareOfBytes * double(*bytes);
    };
    return fills(a) != fills(b) ? fills(a) : a.error < b.error;
  }
  /// Doubling the fineness adds a bit to every parameter, and divides the added error by four.
  [[nodiscard]] double slope() const {
    return bytes ? kParametersPerEllipsoid / 8.0 * double(std::max<std::size_t>(ellipsoids, 1))
                 : 2.0;
  }
  [[nodiscard]] double aim() const {
    if (bytes) return 0.5 * (1.0 + kSufficientShareOfBytes) * double(*bytes);
    return -std::log2(kAimedShareOfBudget * budget());
  }
  [[nodiscard]] double figure(const RateTrial& trial) const {
    if (bytes) return double(trial.bytes);
    return -std::log2(std::max(trial.error - base, 1e-3 * budget()));
  }
  [[nodiscard]] double bracket() const { return bytes ? kSizeBracket : kErrorBracket; }
  [[nodiscard]] RootSearch search(double first) const {
    return {{-kMostOctaves, kMostOctaves, bracket()}, aim(), slope(), first};
  }
};

/// Scales all steps together until they are within kBalanceRange of the goal's.
RateTrial approach(RateTrials& trials, const StepGoal& goal, const QuantiserSteps& steps) {
  RootSearch search = goal.search(0.0);
  for (int n = 1;; ++n) {
    const double fineness = search.next();
    RateTrial trial = trials.make(finer(steps, fineness));
    search.learn(goal.figure(trial));
    if (n >= kFirstTrials || std::abs(search.next() - fineness) < kBalanceRange) return trial;
  }
}

/// Scales all steps together until the limit is used well.
RateTrial scaleTo(RateTrials& trials, const StepGoal& goal, const QuantiserSteps& steps) {
  RootSearch search = goal.search(0.0);
  std::optional<RateTrial> best;
  for (int n = 0; n < kMaxTrials && !(search.ended() && best && goal.met(*best)); ++n) {
    RateTrial trial = trials.make(finer(steps, search.next()));
    search.learn(goal.figure(trial));
    const bool replaces =
        !best || (goal.met(trial) != goal.met(*best) ? goal.met(trial) : goal.better(trial, *best));
    if (replaces) best = std::move(trial);
    if (goal.met(*best) && goal.nearlyMissed(*best)) break;
  }
  return std::move(*best);
}

/// The effect of removing half a bit from each parameter of one stream.
struct Probe {
  double added = 0.0;  ///< added error on the sampled bricks
  double saved = 0.0;  ///< saved bytes

  /// Added error per saved byte: 0 if coarser steps add no error, infinite if they save nothing.
  [[nodiscard]] double price() const { return saved > 0.0 ? added / saved : HUGE_VAL; }
};

/// Changes the steps so that a saved byte adds the same error in every stream.
/// \return the new steps, with the expected error and bytes
RateTrial balanced(RateTrials& trials, const RateTrial& here) {
  // the given steps, then for each stream the same with a coarser step of this stream
  std::array<QuantiserSteps, 1 + kStreams.size()> tried;
  tried.fill(here.steps);
  for (std::size_t k = 0; k < kStreams.size(); ++k) tried[1 + k].*kStreams[k] *= kProbeFactor;
  const auto made = trials.sample(tried);
  std::array<Probe, kStreams.size()> probes;
  double logPrices = 0.0, priced = 0.0;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    probes[k] = {std::max(made[1 + k].error - made[0].error, 0.0),
                 double(made[0].bytes) - double(made[1 + k].bytes)};
    const double price = probes[k].price();
    if (price > 0.0 && price < HUGE_VAL) logPrices += std::log(price), priced += 1.0;
  }
  const double mean = priced > 0.0 ? std::exp(logPrices / priced) : 0.0;
  QuantiserSteps steps = here.steps;
  double before = 0.0, after = 0.0, saved = 0.0;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    // The added error grows with the square of the step, so that this change makes the prices equal.
    const double price = probes[k].price();
    const double change = std::clamp(price > 0.0 ? std::sqrt(mean / price) : kMaxBalanceFactor,
                                     1.0 / kMaxBalanceFactor, kMaxBalanceFactor);
    steps.*kStreams[k] *= change;
    // The probe doubles the square of the step, so it adds as much error as there was before.
    before += probes[k].added, after += probes[k].added * change * change;
    saved += probes[k].saved * std::log(change) / std::log(kProbeFactor);
  }
  const double added = std::max(here.error - trials.leastError(), 0.0);
  return {steps,
          {},
          {},
          trials.leastError() + added * (before > 0.0 ? after / before : 1.0),
          std::uint64_t(std::max(double(here.bytes) - saved, 0.0))};
}

/// Steps in the best proportions for a goal, which should just meet it.
QuantiserSteps stepsFor(RateTrials& trials, const StepGoal& goal, const QuantiserSteps& guess) {
  const RateTrial expected = balanced(trials, approach(trials, goal, guess));
  return finer(expected.steps, (goal.aim() - goal.figure(expected)) / goal.slope());
}

/// The best steps for a goal. If no trial meets it, the result is the one that misses it by the least.
RateTrial chooseSteps(RateTrials& trials, const StepGoal& goal, const QuantiserSteps& guess) {
  return scaleTo(trials, goal, stepsFor(trials, goal, guess));
}

StepGoal errorGoal(const RateTrials& trials, double allowed) {
  return {.allowed = allowed, .base = trials.leastError(), .ellipsoids = trials.count()};
}

StepGoal bytesGoal(const RateTrials& trials, std::uint64_t bytes) {
  return {.bytes = bytes, .ellipsoids = trials.count()};
}

/// Steps that should use up the error that rounding may add.
QuantiserSteps stepsWithin(const RateTrials& trials, double allowed) {
  const double budget = std::max(allowed - trials.leastError(), kMinBudgetShareOfAllowed * allowed);
  return stepsThatAdd(budget, trials.count());
}

QuantiserSteps usualSteps(const RateTrials& trials) {
  const double added = kUsualAddedShareOfError * std::max(trials.error(), trials.negligibleError());
  return stepsThatAdd(added, trials.count());
}

// ---- Compacting a grid

/// Margin on a wanted PSNR, dB: a reader's sums have another order than the trials' and must still reach it. Up to
/// kMaxPsnrOfMargin, a reader's PSNR differs from a GPU trial's by less.
constexpr double kPsnrMargin = 5e-4, kMaxPsnrOfMargin = 80.0;

/// With an exact mask, a reader's PSNR differs from that of the trials, which know no mask. The PSNR of the trials is
/// corrected by what the result misses or exceeds, at most kMaxCorrections times, unless it exceeds the wanted PSNR by
/// kSmallExcess, dB, at most.
constexpr int kMaxCorrections = 2;
constexpr double kSmallExcess = 0.05;

/// What a result may exceed a judged quality by, dB, the octaves by which the steps may be scaled for it, those that make
/// no difference, and the results that are measured. A judge's PSNR is that of scaled sums, from which that of a
/// reader, who decodes, differs by 1e-7 dB.
constexpr double kQualitySpare = 0.08, kMostFiner = 3.0, kNarrowestFiner = 0.02,
                 kJudgedMargin = 1e-5;
constexpr int kMostJudged = 4;

/// What the PSNR of a reader exceeds the wanted one by, dB.
double excessOf(const StoredGrid& grid, const SparseVolume& source, const CompactOptions& options) {
  return psnrOverBox(source, decodeGrid(grid, {.memory = memoryOf(source)}),
                     {.box = options.box, .peak = options.peak}) -
         *options.psnr;
}

double allowedError(const RateTrials& trials, const CompactOptions& options) {
  if (options.psnr) return trials.squaresOf(*options.psnr + kPsnrMargin);
  return trials.error() * std::pow(10.0, options.loss / 10.0) + trials.negligibleError();
}

/// \param searches  false: a limit of the error is met by one trial more or less
RateTrial chosen(RateTrials& trials, const CompactOptions& options, bool searches = true) {
  if (options.bytes)
    return options.quick
               ? scaleTo(trials, bytesGoal(trials, *options.bytes), usualSteps(trials))
               : chooseSteps(trials, bytesGoal(trials, *options.bytes), usualSteps(trials));
  const double allowed = allowedError(trials, options);
  const QuantiserSteps guess = stepsWithin(trials, allowed);
  if (options.quick) return trials.make(guess);
  if (trials.leastError() >= allowed) return trials.make(scaled(guess, kFinestFactor));
  const StepGoal goal = errorGoal(trials, allowed);
  return searches ? chooseSteps(trials, goal, guess) : trials.make(stepsFor(trials, goal, guess));
}

}  // namespace

std::vector<LayerError> layerErrorsOf(const StoredGrid& grid, const SparseVolume& source,
                                      const CompareOptions& options) {
  std::vector<LayerError> errors;
  const std::size_t layers = layerCount(grid);
  for (std::size_t k = 1; k <= layers && layers > 1; ++k) {
    const auto metrics = compareVolumes(
        source, decodeGrid(firstLayers(grid, k), {.memory = memoryOf(source)}), options);
    errors.push_back({float(metrics.psnrBox), float(metrics.maxError)});
  }
  return errors;
}

QuantiserSteps finer(QuantiserSteps steps, double octaves) {
  return scaled(steps, std::exp2(-octaves));
}

Compactor::Compactor(const StoredGrid& grid, const SparseVolume& source,
                     const CompactOptions& options)
    : grid_(grid),
      source_(source),
      options_(options),
      box_(options.box.value_or(activeBox(source))) {
  if (grid.field.ellipsoidCount() > 0) trials_.emplace(grid, source, options);
}

CompactResult Compactor::toGoal() {
  if (!trials_) return {grid_, {}, 0.0, 0};
  return resultOf(chosen(*trials_, options_));
}

CompactResult Compactor::toPsnrOfReader() {
  CompactResult best = toGoal();
  CompactOptions aimed = options_;
  double excess = excessOf(best.grid, source_, options_), last = excess;
  for (int n = 0; trials_ && n < kMaxCorrections && !(excess >= 0.0 && excess <= kSmallExcess);
       ++n) {
    *aimed.psnr += 0.5 * kSmallExcess - last;
    CompactResult now = resultOf(chosen(*trials_, aimed));
    last = excessOf(now.grid, source_, options_);
    const bool isBetter = excess < 0.0 ? last > excess : last >= 0.0 && now.bytes < best.bytes;
    if (isBetter) best = std::move(now), excess = last;
  }
  return best;
}

CompactResult Compactor::at(const QuantiserSteps& steps) {
  if (!trials_) return {grid_, {}, 0.0, 0};
  return resultOf(trials_->make(steps));
}

JudgedResult Compactor::toQuality(const JudgedGoal& goal) {
  if (!trials_) return scaledTo(goal, toGoal());
  JudgedResult best =
      scaledTo(goal, goal.first ? at(*goal.first) : resultOf(chosen(*trials_, options_, false)));
  if (best.quality >= goal.quality || CancelScope::cancelled()) return best;
  // Of a dozen ellipsoids, the quality jumps. Steps that were searched for may have it.
  auto again = unlessCancelled([&] { return std::optional(scaledTo(goal, toGoal())); });
  return again && again->quality > best.quality ? std::move(*again) : std::move(best);
}

/// Scales the steps of a first result until its quality is the wanted one.
JudgedResult Compactor::scaledTo(const JudgedGoal& goal, CompactResult made) {
  const QuantiserSteps steps = made.steps;
  RootSearch search({-kMostFiner, kMostFiner, kNarrowestFiner}, goal.quality + 0.5 * kQualitySpare,
                    std::log(4.0) * goal.loss, 0.0);
  std::optional<JudgedResult> best;
  double bestOver = -HUGE_VAL;
  for (int n = 1;; ++n) {
    const double quality = goal.judge(made), over = quality - goal.quality - kJudgedMargin;
    const bool isBetter = bestOver < 0.0 ? over > bestOver : over >= 0.0 && over < bestOver;
    if (isBetter) best = JudgedResult{std::move(made), quality}, bestOver = over;
    if ((over >= 0.0 && over <= kQualitySpare) || CancelScope::cancelled()) break;
    search.learn(quality);
    if (n == kMostJudged || search.ended()) break;
    auto next = unlessCancelled([&] { return std::optional(at(finer(steps, search.next()))); });
    if (!next) break;
    made = std::move(*next);
  }
  return std::move(*best);
}

CompactResult Compactor::resultOf(RateTrial trial) {
  CompactResult result{grid_, trial.steps, 0.0, trial.bytes};
  if (options_.quick) trial.error = trials_->measure(trial);
  const double before = trials_->error();
  result.loss = before > 0.0 ? 10.0 * std::log10(trial.error / before) : 0.0;
  // The trials know no mask, and no voxels outside the active box that become the background.
  const bool sameRule =
      grid_.topology != TopologyKind::kMask && common(box_, grid_.activeBox) == box_;
  const bool hasErrors = options_.layerErrors && !options_.quick;
  result.grid.layerErrors.clear();
  if (hasErrors && sameRule) result.grid.layerErrors = trials_->layerErrors(trial);
  result.grid.field = std::move(trial.field);
  result.grid.quantised = std::move(trial.quantised);
  if (hasErrors && !sameRule)
    result.grid.layerErrors =
        layerErrorsOf(result.grid, source_, {.box = box_, .peak = options_.peak});
  return result;
}

CompactResult compactGrid(const StoredGrid& grid, const SparseVolume& source,
                          const CompactOptions& options) {
  for (const auto& chunk : grid.field.chunks)
    if (!chunk.ellipsoids.kappa.empty())
      throw RuntimeFailure("cannot quantise grid '" + shownName(grid.descriptor.name) +
                           "': its ellipsoids have kappas of their own");
  Compactor compactor(grid, source, options);
  if (options.quick || !options.psnr) return compactor.toGoal();
  if (grid.topology == TopologyKind::kMask) return compactor.toPsnrOfReader();
  CompactResult result = compactor.toGoal();
  // A reader may miss the PSNR of a GPU's trial near the precision of float32 only.
  const bool mayBeMissed =
      options.device.kind == DeviceKind::kCuda && *options.psnr >= kMaxPsnrOfMargin;
  if (!mayBeMissed || excessOf(result.grid, source, options) >= 0.0) return result;
  CompactOptions again = options;
  again.device = {};
  return compactGrid(grid, source, again);
}

}  // namespace esvr::encode
