#include "compact/choose_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace esvr {
namespace {

constexpr int kFirstTrials = 3, kMaxTrials = 10;
constexpr double kNear = 1.6;          // a factor of the steps: slopes are alike within
constexpr double kParameters = 10.0;   // of an ellipsoid
constexpr double kEnough = 0.93;       // of the budget: the next scaling would gain little
constexpr double kAim = 0.965;         // of the budget: between that and all of it
constexpr double kErrorNarrow = 1.05;  // a factor of the steps: less is a hundredth of the bytes
constexpr double kSizeNarrow = 1.01;
constexpr double kFullEnough = 0.994;     // of the bytes
constexpr double kFull = 0.985;           // of the bytes: less was not asked for
constexpr double kProbe = 1.41421356237;  // half a bit
constexpr double kMaxChange = 2.0;        // of one stream's step against the others
constexpr double kMinAdded = 0.02;        // of the budget: below, scale boldly
constexpr double kMinGuess = 0.02;        // of the error allowed
constexpr double kLeft = 0.75;            // of the error of rounding, by solving for intensities
constexpr double kFirstLoss = 0.2;        // of the error: usual where bytes are short
constexpr double kFine = 0.1;             // of the first guess: adds a hundredth of the budget

constexpr std::array kStreams{&QuantiserSteps::position, &QuantiserSteps::scale,
                              &QuantiserSteps::rotation, &QuantiserSteps::intensity};

QuantiserSteps scaled(QuantiserSteps steps, double factor) {
  for (const auto stream : kStreams) steps.*stream *= factor;
  return steps;
}

/// What a search is for.
class Goal {
 public:
  virtual ~Goal() = default;
  [[nodiscard]] virtual bool met(const Trial& trial) const = 0;
  [[nodiscard]] virtual bool metByFinerSteps() const = 0;
  [[nodiscard]] virtual bool nearlyMissed(const Trial& trial) const = 0;
  /// Factor between steps that meet it and steps that do not: less would gain little. Errors jump
  /// where the lattice does.
  [[nodiscard]] virtual double narrow() const = 0;
  /// Of two that meet it, or of two that do not.
  [[nodiscard]] virtual bool better(const Trial& a, const Trial& b) const = 0;
  /// Factor of the steps that should bring a trial to the goal's edge.
  /// \param before  another trial, its steps in the same proportions; may be the trial itself
  [[nodiscard]] virtual double correction(const Trial& trial, const Trial& before) const = 0;
};

/// An error that is not to be exceeded. What rounding adds grows with the square of the steps.
class ErrorGoal : public Goal {
 public:
  /// \param base  the error that is there without rounding
  ErrorGoal(double allowed, double base) : allowed_(allowed), base_(base) {}

  [[nodiscard]] bool met(const Trial& trial) const override { return trial.error <= allowed_; }
  [[nodiscard]] bool metByFinerSteps() const override { return true; }
  [[nodiscard]] double narrow() const override { return kErrorNarrow; }
  [[nodiscard]] bool nearlyMissed(const Trial& trial) const override {
    return trial.error >= allowed_ - (1.0 - kEnough) * budget();
  }
  [[nodiscard]] bool better(const Trial& a, const Trial& b) const override {
    return met(a) ? a.bytes < b.bytes : a.error < b.error;
  }
  [[nodiscard]] double correction(const Trial& trial, const Trial&) const override {
    const double added = std::max(trial.error - base_, kMinAdded * budget());
    return std::clamp(std::sqrt(kAim * budget() / added), 0.25, 4.0);
  }

 private:
  [[nodiscard]] double budget() const { return allowed_ - base_; }

  double allowed_, base_;
};

/// Bytes that are not to be exceeded. Twice the step saves a bit of every parameter.
class SizeGoal : public Goal {
 public:
  SizeGoal(std::uint64_t bytes, std::size_t ellipsoids)
      : bytes_(bytes), bytesAnOctave_(kParameters / 8.0 * double(ellipsoids)) {}

  [[nodiscard]] bool met(const Trial& trial) const override { return trial.bytes <= bytes_; }
  [[nodiscard]] bool metByFinerSteps() const override { return false; }
  [[nodiscard]] double narrow() const override { return kSizeNarrow; }
  [[nodiscard]] bool nearlyMissed(const Trial& trial) const override {
    return double(trial.bytes) >= kFullEnough * double(bytes_);
  }
  [[nodiscard]] bool better(const Trial& a, const Trial& b) const override {
    if (!met(a)) return a.bytes < b.bytes;
    return fills(a) != fills(b) ? fills(a) : a.error < b.error;
  }
  [[nodiscard]] double correction(const Trial& trial, const Trial& before) const override {
    const double aim = 0.5 * (1.0 + kFullEnough) * double(bytes_);
    const double octaves = (double(trial.bytes) - aim) / slope(trial, before);
    return std::clamp(std::exp2(octaves), 0.05, 20.0);
  }

 private:
  [[nodiscard]] bool fills(const Trial& trial) const {
    return double(trial.bytes) >= kFull * double(bytes_);
  }

  /// Bytes an octave, as far as two trials tell: less where parameters have no bits left to lose.
  [[nodiscard]] double slope(const Trial& a, const Trial& b) const {
    const double octaves = std::log2(a.steps.scale / b.steps.scale);
    if (octaves == 0.0) return bytesAnOctave_;
    const double measured = (double(b.bytes) - double(a.bytes)) / octaves;
    return std::clamp(measured, 0.2 * bytesAnOctave_, 1.5 * bytesAnOctave_);
  }

  std::uint64_t bytes_;
  double bytesAnOctave_;
};

/// Independent roundings, each with a variance of a twelfth of its step's square.
QuantiserSteps stepsThatAdd(double error, std::size_t ellipsoids) {
  const double step = std::sqrt(12.0 * error / (kLeft * kParameters * double(ellipsoids)));
  return {step, step, step, step};
}

/// Steps scaled together until a goal is near.
Trial approach(TrialMaker& maker, const Goal& goal, const QuantiserSteps& steps) {
  Trial trial = maker.make(steps);
  for (int n = 1; n < kFirstTrials; ++n) {
    const double factor = goal.correction(trial, trial);
    if (factor < kNear && factor > 1.0 / kNear) break;
    trial = maker.make(scaled(trial.steps, factor));
  }
  return trial;
}

/// Steps scaled together until a goal is all but missed.
Trial scaleTo(TrialMaker& maker, const Goal& goal, const QuantiserSteps& steps) {
  Trial best = maker.make(steps);
  Trial last = best, before = best;
  double high = HUGE_VAL, low = 0.0, factor = 1.0;  // factors known to lie beyond and short of it
  for (int n = 1; n < kMaxTrials; ++n) {
    if (goal.met(best) && (goal.nearlyMissed(best) || high < goal.narrow() * low)) break;
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

/// What half a bit less of one stream does.
struct Probe {
  double added = 0.0;  ///< error of a sample: no unit
  double saved = 0.0;  ///< bytes

  /// Error added by a byte saved: 0 where coarser costs nothing, infinite where it saves nothing.
  [[nodiscard]] double slope() const { return saved > 0.0 ? added / saved : HUGE_VAL; }
};
using Probes = std::array<Probe, kStreams.size()>;

Probes probe(TrialMaker& maker, const QuantiserSteps& steps) {
  std::array<QuantiserSteps, 1 + kStreams.size()> tried;  // as they are, then one coarser each
  tried.fill(steps);
  for (std::size_t k = 0; k < kStreams.size(); ++k) tried[1 + k].*kStreams[k] *= kProbe;
  const auto trials = maker.sample(tried);
  Probes probes;
  for (std::size_t k = 0; k < probes.size(); ++k)
    probes[k] = {std::max(trials[1 + k].error - trials[0].error, 0.0),
                 double(trials[0].bytes) - double(trials[1 + k].bytes)};
  return probes;
}

/// The geometric mean of slopes that are neither 0 nor infinite; 0 where there are none.
double meanSlope(const Probes& probes) {
  double sum = 0.0;
  int counted = 0;
  for (const Probe& p : probes)
    if (p.slope() > 0.0 && p.slope() < HUGE_VAL) sum += std::log(p.slope()), ++counted;
  return counted > 0 ? std::exp(sum / counted) : 0.0;
}

/// Factor of a stream's step that makes its slope the mean one: a stream's cost grows with the
/// square of its step.
double changeOf(const Probe& probe, double mean) {
  const double change = probe.slope() > 0.0 ? std::sqrt(mean / probe.slope()) : kMaxChange;
  return std::clamp(change, 1.0 / kMaxChange, kMaxChange);
}

/// What a saved byte costs must be the same in every stream.
/// \return  steps, and the error and the bytes to expect of them
Trial balanced(TrialMaker& maker, const Trial& here) {
  const Probes probes = probe(maker, here.steps);
  const double mean = meanSlope(probes);
  QuantiserSteps steps = here.steps;
  double before = 0.0, after = 0.0, saved = 0.0;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    const double change = changeOf(probes[k], mean);
    steps.*kStreams[k] *= change;
    // twice the square of a step adds as much error as there is of it
    before += probes[k].added, after += probes[k].added * change * change;
    saved += probes[k].saved * std::log(change) / std::log(kProbe);
  }
  const double added = std::max(here.error - maker.leastError(), 0.0);
  return {steps,
          {},
          {},
          maker.leastError() + added * (before > 0.0 ? after / before : 1.0),
          std::uint64_t(std::max(double(here.bytes) - saved, 0.0))};
}

Trial search(TrialMaker& maker, const Goal& goal, const QuantiserSteps& guess) {
  const Trial near = approach(maker, goal, guess);
  const Trial expected = balanced(maker, near);
  return scaleTo(maker, goal, scaled(expected.steps, goal.correction(expected, expected)));
}

}  // namespace

Trial chooseStepsWithin(TrialMaker& maker, double allowed) {
  const double left = std::max(allowed - maker.leastError(), kMinGuess * allowed);
  const QuantiserSteps guess = stepsThatAdd(left, maker.count());
  if (maker.leastError() >= allowed) return maker.make(scaled(guess, kFine));
  return search(maker, ErrorGoal(allowed, maker.leastError()), guess);
}

Trial chooseStepsFor(TrialMaker& maker, std::uint64_t bytes) {
  const double likely = kFirstLoss * std::max(maker.error(), maker.invisibleError());
  return search(maker, SizeGoal(bytes, maker.count()), stepsThatAdd(likely, maker.count()));
}

}  // namespace esvr
