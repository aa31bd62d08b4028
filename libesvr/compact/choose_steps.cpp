#include "compact/choose_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace esvr {
namespace {

constexpr double kParametersPerEllipsoid = 10.0;

// The numbers below decide how many trials a choice takes (docs/lab-notes.md, "Number of trials")
// and how much of a limit may stay unused. The budget is the error that rounding may add: the
// allowed error less the error without rounding.

/// Trials of approach() and of scaleTo().
constexpr int kFirstTrials = 3, kMaxTrials = 10;

/// Streams are balanced at steps within this factor of the goal's; their costs change little there.
constexpr double kBalanceRange = 1.6;
/// Factor of the steps of a probe, which removes half a bit of each parameter of a stream.
constexpr double kProbeFactor = 1.41421356237;
/// Largest factor by which balancing changes the step of one stream.
constexpr double kMaxBalanceFactor = 2.0;

/// Share of the budget that a result must use, and the share that scaling aims at.
constexpr double kSufficientShareOfBudget = 0.93, kAimedShareOfBudget = 0.965;
/// Share of the bytes that a result should use at least, and the share that ends the search.
constexpr double kMinShareOfBytes = 0.985, kSufficientShareOfBytes = 0.994;
/// Factor between met and missed steps at which a search ends; 1.05 is a hundredth of the bytes.
constexpr double kErrorBracket = 1.05, kSizeBracket = 1.01;

/// Smallest added error, as a share of the budget, from which a correction is computed.
constexpr double kMinAddedShareOfBudget = 0.02;
/// Smallest budget for the first guess, as a share of the allowed error.
constexpr double kMinBudgetShareOfAllowed = 0.02;
/// Share of the rounding error that remains after solving for the intensities.
constexpr double kErrorShareAfterSolve = 0.75;
/// Error that rounding usually adds when bytes are short, as a share of the fit's error.
constexpr double kUsualAddedShareOfError = 0.2;
/// Factor of the first guess if no error may be added; it adds a hundredth of the guess's error.
constexpr double kFinestFactor = 0.1;

constexpr std::array kStreams{&QuantiserSteps::position, &QuantiserSteps::scale,
                              &QuantiserSteps::rotation, &QuantiserSteps::intensity};

QuantiserSteps scaled(QuantiserSteps steps, double factor) {
  for (const auto stream : kStreams) steps.*stream *= factor;
  return steps;
}

/// The goal of a search.
class TrialGoal {
 public:
  virtual ~TrialGoal() = default;
  [[nodiscard]] virtual bool met(const Trial& trial) const = 0;
  [[nodiscard]] virtual bool metByFinerSteps() const = 0;
  /// True if a trial that meets the goal uses enough of the limit.
  [[nodiscard]] virtual bool nearlyMissed(const Trial& trial) const = 0;
  /// Factor between met and missed steps at which the search ends. Errors are not continuous in the
  /// steps, so the search need not converge further.
  [[nodiscard]] virtual double bracket() const = 0;
  /// Compares two trials that both meet the goal or both miss it.
  [[nodiscard]] virtual bool better(const Trial& a, const Trial& b) const = 0;
  /// Factor of the steps that should bring a trial to the limit.
  /// \param before  another trial, its steps in the same proportions; may be the trial itself
  [[nodiscard]] virtual double correction(const Trial& trial, const Trial& before) const = 0;
};

/// A limit on the error. The error that rounding adds grows with the square of the steps.
class ErrorGoal : public TrialGoal {
 public:
  /// \param base  error without rounding
  ErrorGoal(double allowed, double base) : allowed_(allowed), base_(base) {}

  [[nodiscard]] bool met(const Trial& trial) const override { return trial.error <= allowed_; }
  [[nodiscard]] bool metByFinerSteps() const override { return true; }
  [[nodiscard]] double bracket() const override { return kErrorBracket; }
  [[nodiscard]] bool nearlyMissed(const Trial& trial) const override {
    return trial.error >= allowed_ - (1.0 - kSufficientShareOfBudget) * budget();
  }
  [[nodiscard]] bool better(const Trial& a, const Trial& b) const override {
    return met(a) ? a.bytes < b.bytes : a.error < b.error;
  }
  [[nodiscard]] double correction(const Trial& trial, const Trial&) const override {
    const double added = std::max(trial.error - base_, kMinAddedShareOfBudget * budget());
    return std::clamp(std::sqrt(kAimedShareOfBudget * budget() / added), 0.25, 4.0);
  }

 private:
  [[nodiscard]] double budget() const { return allowed_ - base_; }

  double allowed_, base_;
};

/// A limit on the bytes. Doubling the steps saves one bit of every parameter.
class BytesGoal : public TrialGoal {
 public:
  BytesGoal(std::uint64_t bytes, std::size_t ellipsoids)
      : bytes_(bytes), bytesPerOctave_(kParametersPerEllipsoid / 8.0 * double(ellipsoids)) {}

  [[nodiscard]] bool met(const Trial& trial) const override { return trial.bytes <= bytes_; }
  [[nodiscard]] bool metByFinerSteps() const override { return false; }
  [[nodiscard]] double bracket() const override { return kSizeBracket; }
  [[nodiscard]] bool nearlyMissed(const Trial& trial) const override {
    return double(trial.bytes) >= kSufficientShareOfBytes * double(bytes_);
  }
  [[nodiscard]] bool better(const Trial& a, const Trial& b) const override {
    if (!met(a)) return a.bytes < b.bytes;
    return fills(a) != fills(b) ? fills(a) : a.error < b.error;
  }
  [[nodiscard]] double correction(const Trial& trial, const Trial& before) const override {
    const double aim = 0.5 * (1.0 + kSufficientShareOfBytes) * double(bytes_);
    const double octaves = (double(trial.bytes) - aim) / slope(trial, before);
    return std::clamp(std::exp2(octaves), 0.05, 20.0);
  }

 private:
  [[nodiscard]] bool fills(const Trial& trial) const {
    return double(trial.bytes) >= kMinShareOfBytes * double(bytes_);
  }

  /// Bytes saved by doubling the steps, measured from two trials. It is less than bytesPerOctave_
  /// if some parameters have no bits left.
  [[nodiscard]] double slope(const Trial& a, const Trial& b) const {
    const double octaves = std::log2(a.steps.scale / b.steps.scale);
    if (octaves == 0.0) return bytesPerOctave_;
    const double measured = (double(b.bytes) - double(a.bytes)) / octaves;
    return std::clamp(measured, 0.2 * bytesPerOctave_, 1.5 * bytesPerOctave_);
  }

  std::uint64_t bytes_;
  double bytesPerOctave_;
};

/// Equal steps that should add an error. Rounding errors are taken as independent, each with a
/// variance of step^2 / 12.
QuantiserSteps stepsThatAdd(double error, std::size_t ellipsoids) {
  const double roundings = kParametersPerEllipsoid * double(ellipsoids);
  const double step = std::sqrt(12.0 * error / (kErrorShareAfterSolve * roundings));
  return {step, step, step, step};
}

/// Scales all steps together until they are within kBalanceRange of the goal's.
Trial approach(TrialMaker& maker, const TrialGoal& goal, const QuantiserSteps& steps) {
  Trial trial = maker.make(steps);
  for (int n = 1; n < kFirstTrials; ++n) {
    const double factor = goal.correction(trial, trial);
    if (factor < kBalanceRange && factor > 1.0 / kBalanceRange) break;
    trial = maker.make(scaled(trial.steps, factor));
  }
  return trial;
}

/// Scales all steps together until the limit is used well.
Trial scaleTo(TrialMaker& maker, const TrialGoal& goal, const QuantiserSteps& steps) {
  Trial best = maker.make(steps);
  Trial last = best, before = best;
  double high = HUGE_VAL, low = 0.0, factor = 1.0;  // the bracket of the wanted factor
  for (int n = 1; n < kMaxTrials; ++n) {
    if (goal.met(best) && (goal.nearlyMissed(best) || high < goal.bracket() * low)) break;
    (goal.met(last) == goal.metByFinerSteps() ? low : high) = factor;
    factor *= goal.correction(last, before);
    if (factor <= low || factor >= high)
      factor = low > 0.0 && high < HUGE_VAL ? std::sqrt(low * high) : factor;
    before = std::move(last);
    last = maker.make(scaled(steps, factor));
    if (goal.met(last) != goal.met(best) ? goal.met(last) : goal.better(last, best)) best = last;
  }
  return best;
}

/// The effect of removing half a bit from each parameter of one stream.
struct Probe {
  double added = 0.0;  ///< added error on the sampled bricks
  double saved = 0.0;  ///< saved bytes

  /// Added error per saved byte: 0 if coarser steps add no error, infinite if they save nothing.
  [[nodiscard]] double slope() const { return saved > 0.0 ? added / saved : HUGE_VAL; }
};
using Probes = std::array<Probe, kStreams.size()>;

Probes probe(TrialMaker& maker, const QuantiserSteps& steps) {
  // the given steps, then for each stream the same with a coarser step of this stream
  std::array<QuantiserSteps, 1 + kStreams.size()> tried;
  tried.fill(steps);
  for (std::size_t k = 0; k < kStreams.size(); ++k) tried[1 + k].*kStreams[k] *= kProbeFactor;
  const auto trials = maker.sample(tried);
  Probes probes;
  for (std::size_t k = 0; k < probes.size(); ++k)
    probes[k] = {std::max(trials[1 + k].error - trials[0].error, 0.0),
                 double(trials[0].bytes) - double(trials[1 + k].bytes)};
  return probes;
}

/// The geometric mean of the slopes that are neither 0 nor infinite; 0 if there are none.
double meanSlope(const Probes& probes) {
  double sum = 0.0;
  int counted = 0;
  for (const Probe& p : probes)
    if (p.slope() > 0.0 && p.slope() < HUGE_VAL) sum += std::log(p.slope()), ++counted;
  return counted > 0 ? std::exp(sum / counted) : 0.0;
}

/// The factor of a stream's step that makes its slope equal to the mean. The added error grows with
/// the square of the step.
double changeOf(const Probe& probe, double mean) {
  const double change = probe.slope() > 0.0 ? std::sqrt(mean / probe.slope()) : kMaxBalanceFactor;
  return std::clamp(change, 1.0 / kMaxBalanceFactor, kMaxBalanceFactor);
}

/// Changes the steps so that a saved byte adds the same error in every stream.
/// \return the new steps, with the expected error and bytes
Trial balanced(TrialMaker& maker, const Trial& here) {
  const Probes probes = probe(maker, here.steps);
  const double mean = meanSlope(probes);
  QuantiserSteps steps = here.steps;
  double before = 0.0, after = 0.0, saved = 0.0;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    const double change = changeOf(probes[k], mean);
    steps.*kStreams[k] *= change;
    // the probe doubles the square of the step, so it adds as much error as there was before
    before += probes[k].added, after += probes[k].added * change * change;
    saved += probes[k].saved * std::log(change) / std::log(kProbeFactor);
  }
  const double added = std::max(here.error - maker.leastError(), 0.0);
  return {steps,
          {},
          {},
          maker.leastError() + added * (before > 0.0 ? after / before : 1.0),
          std::uint64_t(std::max(double(here.bytes) - saved, 0.0))};
}

Trial search(TrialMaker& maker, const TrialGoal& goal, const QuantiserSteps& guess) {
  const Trial expected = balanced(maker, approach(maker, goal, guess));
  return scaleTo(maker, goal, scaled(expected.steps, goal.correction(expected, expected)));
}

/// Steps that should use up the error that rounding may add.
QuantiserSteps firstGuess(TrialMaker& maker, double allowed) {
  const double budget = std::max(allowed - maker.leastError(), kMinBudgetShareOfAllowed * allowed);
  return stepsThatAdd(budget, maker.count());
}

QuantiserSteps usualSteps(TrialMaker& maker) {
  const double added = kUsualAddedShareOfError * std::max(maker.error(), maker.negligibleError());
  return stepsThatAdd(added, maker.count());
}

}  // namespace

Trial firstStepsWithin(TrialMaker& maker, double allowed) {
  return maker.make(firstGuess(maker, allowed));
}

Trial firstStepsFor(TrialMaker& maker, std::uint64_t bytes) {
  return scaleTo(maker, BytesGoal(bytes, maker.count()), usualSteps(maker));
}

Trial chooseStepsWithin(TrialMaker& maker, double allowed) {
  const QuantiserSteps guess = firstGuess(maker, allowed);
  if (maker.leastError() >= allowed) return maker.make(scaled(guess, kFinestFactor));
  return search(maker, ErrorGoal(allowed, maker.leastError()), guess);
}

Trial chooseStepsFor(TrialMaker& maker, std::uint64_t bytes) {
  return search(maker, BytesGoal(bytes, maker.count()), usualSteps(maker));
}

}  // namespace esvr
