#include "compact/choose_steps.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace esvr {
namespace {

constexpr int kSearchIterations = 6, kFinalIterations = 24;  // of the solver
constexpr int kFirstScalings = 3, kMostScalings = 12;
constexpr double kParameters = 10.0;      // of an ellipsoid
constexpr double kEnough = 0.93;          // of the budget: the next scaling would gain little
constexpr double kFullEnough = 0.994;     // of the bytes
constexpr double kFull = 0.985;           // of the bytes: less was not asked for
constexpr double kProbe = 1.41421356237;  // half a bit
constexpr double kMostChange = 2.0;       // of one stream's step against the others
constexpr double kLeastAdded = 0.02;      // of the budget: below, scale boldly
constexpr double kLeastGuess = 0.02;      // of the error allowed
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
  [[nodiscard]] bool nearlyMissed(const Trial& trial) const override {
    return trial.error >= allowed_ - (1.0 - kEnough) * budget();
  }
  [[nodiscard]] bool better(const Trial& a, const Trial& b) const override {
    return met(a) ? a.bytes < b.bytes : a.error < b.error;
  }
  [[nodiscard]] double correction(const Trial& trial, const Trial&) const override {
    const double added = std::max(trial.error - base_, kLeastAdded * budget());
    return std::clamp(std::sqrt(budget() / added), 0.25, 4.0);
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
  const double step = std::sqrt(12.0 * error / (kParameters * double(ellipsoids)));
  return {step, step, step, step};
}

/// Steps scaled together until a goal is all but missed.
Trial scaleTo(const TrialMaker& maker, const Goal& goal, const QuantiserSteps& steps,
              int iterations, int most) {
  Trial best = maker.make(steps, iterations);
  Trial last = best, before = best;
  double high = HUGE_VAL, low = 0.0, factor = 1.0;  // factors known to lie beyond and short of it
  for (int n = 1; n < most; ++n) {
    if (goal.met(best) && goal.nearlyMissed(best)) break;
    (goal.met(last) == goal.metByFinerSteps() ? low : high) = factor;
    factor *= goal.correction(last, before);
    if (factor <= low || factor >= high)
      factor = low > 0.0 && high < HUGE_VAL ? std::sqrt(low * high) : factor;
    before = std::move(last);
    last = maker.make(scaled(steps, factor), iterations);
    if (goal.met(last) != goal.met(best) ? goal.met(last) : goal.better(last, best)) best = last;
  }
  return best;
}

/// Error added by a byte saved, where a stream's step is made coarser; 0 where coarser costs
/// nothing, infinite where it saves nothing.
double slopeOf(const TrialMaker& maker, const Trial& here, double QuantiserSteps::*stream) {
  QuantiserSteps coarser = here.steps;
  coarser.*stream *= kProbe;
  const Trial there = maker.make(coarser, kSearchIterations);
  const double saved = double(here.bytes) - double(there.bytes);
  return saved > 0.0 ? std::max(there.error - here.error, 0.0) / saved : HUGE_VAL;
}

/// The geometric mean of those that are neither 0 nor infinite; 0 where there are none.
double meanOf(const std::array<double, kStreams.size()>& slopes) {
  double sum = 0.0;
  int counted = 0;
  for (const double slope : slopes)
    if (slope > 0.0 && slope < HUGE_VAL) sum += std::log(slope), ++counted;
  return counted > 0 ? std::exp(sum / counted) : 0.0;
}

/// What a saved byte costs must be the same in every stream; a stream's cost grows with the square
/// of its step.
QuantiserSteps balanced(const TrialMaker& maker, const Trial& here) {
  std::array<double, kStreams.size()> slopes{};
  // side by side: the coding of a trial's bytes keeps to one thread
  tbb::parallel_for(std::size_t{0}, slopes.size(),
                    [&](std::size_t k) { slopes[k] = slopeOf(maker, here, kStreams[k]); });
  const double mean = meanOf(slopes);
  QuantiserSteps steps = here.steps;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    const double change = slopes[k] > 0.0 ? std::sqrt(mean / slopes[k]) : kMostChange;
    steps.*kStreams[k] *= std::clamp(change, 1.0 / kMostChange, kMostChange);
  }
  return steps;
}

Trial search(const TrialMaker& maker, const Goal& goal, const QuantiserSteps& guess) {
  const Trial near = scaleTo(maker, goal, guess, kSearchIterations, kFirstScalings);
  return scaleTo(maker, goal, balanced(maker, near), kFinalIterations, kMostScalings);
}

}  // namespace

Trial chooseStepsWithin(const TrialMaker& maker, double allowed) {
  const double left = std::max(allowed - maker.error(), kLeastGuess * allowed);
  const QuantiserSteps guess = stepsThatAdd(left, maker.count());
  Trial fine = maker.make(scaled(guess, kFine), kFinalIterations);
  if (fine.error >= allowed) return fine;
  return search(maker, ErrorGoal(allowed, fine.error), guess);
}

Trial chooseStepsFor(const TrialMaker& maker, std::uint64_t bytes) {
  const double likely = kFirstLoss * std::max(maker.error(), maker.invisibleError());
  return search(maker, SizeGoal(bytes, maker.count()), stepsThatAdd(likely, maker.count()));
}

}  // namespace esvr
