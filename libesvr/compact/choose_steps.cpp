#include "compact/choose_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace esvr {
namespace {

constexpr int kSearchIterations = 6, kFinalIterations = 24;  // of the solver
constexpr int kMostScalings = 6;
constexpr double kParameters = 10.0;      // of an ellipsoid
constexpr double kEnough = 0.93;          // of the budget: the next scaling would gain little
constexpr double kProbe = 1.41421356237;  // half a bit
constexpr double kMostChange = 2.0;       // of one stream's step against the others
constexpr double kLeastAdded = 0.02;      // of the budget: below, scale boldly
constexpr double kLeastGuess = 0.02;      // of the error allowed
constexpr double kFine = 0.1;             // of the first guess: adds a hundredth of the budget

constexpr std::array kStreams{&QuantiserSteps::position, &QuantiserSteps::scale,
                              &QuantiserSteps::rotation, &QuantiserSteps::intensity};

QuantiserSteps scaled(QuantiserSteps steps, double factor) {
  for (const auto stream : kStreams) steps.*stream *= factor;
  return steps;
}

class Search {
 public:
  Search(const TrialMaker& maker, double allowed) : maker_(maker), allowed_(allowed) {}

  Trial run() {
    const QuantiserSteps guess = firstGuess();
    Trial fine = maker_.make(scaled(guess, kFine), kFinalIterations);
    if (fine.error >= allowed_) return fine;
    base_ = fine.error;
    QuantiserSteps steps = scaledToAllowed(guess, kSearchIterations, kMostScalings / 2).steps;
    steps = balanced(steps);
    return scaledToAllowed(steps, kFinalIterations, kMostScalings);
  }

 private:
  /// The error that is left for rounding.
  [[nodiscard]] double budget() const { return allowed_ - base_; }

  /// Independent roundings, each with a variance of a twelfth of its step's square.
  [[nodiscard]] QuantiserSteps firstGuess() const {
    const double left = std::max(allowed_ - maker_.error(), kLeastGuess * allowed_);
    const double step = std::sqrt(12.0 * left / (kParameters * double(maker_.count())));
    return {step, step, step, step};
  }

  /// Factor that brings the error to what is allowed: what rounding adds grows with the step's
  /// square.
  [[nodiscard]] double correction(const Trial& trial) const {
    const double added = std::max(trial.error - base_, kLeastAdded * budget());
    return std::clamp(std::sqrt(budget() / added), 0.25, 4.0);
  }

  [[nodiscard]] bool better(const Trial& a, const Trial& b) const {
    const bool aFits = a.error <= allowed_, bFits = b.error <= allowed_;
    if (aFits != bFits) return aFits;
    return aFits ? a.bytes < b.bytes : a.error < b.error;
  }

  Trial scaledToAllowed(QuantiserSteps steps, int iterations, int most) {
    Trial best = maker_.make(steps, iterations);
    Trial last = best;
    double fits = 0.0, fails = HUGE_VAL, factor = 1.0;  // of `steps`, known so far
    for (int n = 1; n < most; ++n) {
      (last.error <= allowed_ ? fits : fails) = factor;
      if (best.error <= allowed_ && best.error >= allowed_ - (1.0 - kEnough) * budget()) break;
      factor *= correction(last);
      if (factor <= fits || factor >= fails)
        factor = fits > 0.0 && fails < HUGE_VAL ? std::sqrt(fits * fails) : factor;
      last = maker_.make(scaled(steps, factor), iterations);
      if (better(last, best)) best = last;
    }
    return best;
  }

  /// What a saved byte costs must be the same in every stream; a stream's cost grows with the
  /// square of its step.
  QuantiserSteps balanced(QuantiserSteps steps) {
    const Trial here = maker_.make(steps, kSearchIterations);
    std::array<double, kStreams.size()> slope{};
    double sum = 0.0;  // of the logarithms of slopes that have one
    int counted = 0;
    for (std::size_t k = 0; k < kStreams.size(); ++k) {
      QuantiserSteps coarser = steps;
      coarser.*kStreams[k] *= kProbe;
      const Trial there = maker_.make(coarser, kSearchIterations);
      const double saved = double(here.bytes) - double(there.bytes);
      slope[k] = saved > 0.0 ? std::max(there.error - here.error, 0.0) / saved : HUGE_VAL;
      if (slope[k] > 0.0 && slope[k] < HUGE_VAL) sum += std::log(slope[k]), ++counted;
    }
    const double mean = counted > 0 ? std::exp(sum / counted) : 0.0;
    for (std::size_t k = 0; k < kStreams.size(); ++k) {
      const double change = slope[k] > 0.0 ? std::sqrt(mean / slope[k]) : kMostChange;
      steps.*kStreams[k] *= std::clamp(change, 1.0 / kMostChange, kMostChange);
    }
    return steps;
  }

  const TrialMaker& maker_;
  double allowed_;
  double base_ = 0.0;  ///< error that intensities leave when shapes are hardly rounded
};

}  // namespace

Trial chooseSteps(const TrialMaker& maker, double allowed) { return Search(maker, allowed).run(); }

}  // namespace esvr
