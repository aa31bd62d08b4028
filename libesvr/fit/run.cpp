#include "fit/run.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/kappa_descent.h"

namespace esvr {
namespace {

constexpr std::uint32_t kCurvePoints = 32;  // of one stretch
constexpr double kDbPerDoubling = 5.0;      // typical: sizes the next stretch of a --psnr run
constexpr double kMinGrowth = 1.2, kMaxGrowth = 3.0;
constexpr double kReachedMargin = 1e-3;  // dB: float32 storage must not undo it

/// One stretch of iterations with its own schedule.
class Stretch {
 public:
  Stretch(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
          KappaDescent& kappa)
      : optimiser_(optimiser), target_(target), recorder_(recorder), plan_(plan), kappa_(kappa) {}

  /// \return why it ended; kScheduleDone when it ran to its end
  FitEnd run(const Schedule& schedule, std::uint32_t firstIteration) {
    started_ = recorder_.seconds();
    while (!finished(schedule)) {
      if (recorder_.cancelled()) return FitEnd::kCancelled;
      if (done_ % schedule.eventInterval() == 0) events(schedule, fractionDone(schedule));
      if (done_ % recordInterval(schedule) == 0)
        recorder_.record(optimiser_, firstIteration + done_);
      const double psnr = psnrOf(iterate(schedule), target_.boxVoxels, target_.peak);
      report(psnr, firstIteration, fractionDone(schedule));
      if (plan_.psnr && psnr > *plan_.psnr && reachedExactly(firstIteration))
        return FitEnd::kPsnrReached;
    }
    return plan_.seconds ? FitEnd::kTimeUp : FitEnd::kScheduleDone;
  }
  [[nodiscard]] std::uint32_t iterations() const { return done_; }

 private:
  [[nodiscard]] double fractionDone(const Schedule& schedule, std::uint32_t ahead = 0) const {
    if (!plan_.seconds) return double(done_ + ahead) / schedule.iterations;
    const double left = *plan_.seconds - started_;
    return left > 0.0 ? std::min(1.0, (recorder_.seconds() - started_) / left) : 1.0;
  }
  [[nodiscard]] bool finished(const Schedule& schedule) const {
    return plan_.seconds ? fractionDone(schedule) >= 1.0 : done_ >= schedule.iterations;
  }
  static std::uint32_t recordInterval(const Schedule& schedule) {
    return std::max(schedule.eventInterval(), schedule.iterations / kCurvePoints);
  }

  /// Iterates until something else is due. \return sum of r^2 before the last step
  double iterate(const Schedule& schedule) {
    const auto until = [&](std::uint32_t interval) { return interval - done_ % interval; };
    std::uint32_t count = std::min(
        {optimiser_.batchSize(), until(schedule.eventInterval()), until(recordInterval(schedule))});
    if (!plan_.seconds) count = std::min(count, schedule.iterations - done_);
    std::vector<double> factors;
    for (std::uint32_t k = 0; k < count; ++k)
      factors.push_back(schedule.stepAt(fractionDone(schedule, k), done_ + k));
    done_ += count;
    return optimiser_.iterate(factors);
  }

  void descendKappa(double factor) {
    const float now = optimiser_.kernel().kappa;
    const float next = kappa_.next(now, optimiser_.kappaSlope(), factor);
    if (next != now) optimiser_.setKappa(next);
  }

  void events(const Schedule& schedule, double fraction) {
    if (plan_.learnKappa && done_ > 0) descendKappa(schedule.stepAt(fraction, done_));
    if (done_ > 0)
      optimiser_.relocate(schedule.relocationsAt(fraction, optimiser_.ellipsoidCount()));
    optimiser_.growTo(schedule.countAt(fraction));
  }

  void report(double psnr, std::uint32_t firstIteration, double fraction) {
    TimedCurvePoint now;
    now.seconds = recorder_.seconds();
    now.iteration = firstIteration + done_;
    now.ellipsoids = optimiser_.ellipsoidCount();
    now.psnrBox = psnr;
    recorder_.report(now, fraction);
  }

  /// The loss was that before the step: measure what there is now.
  bool reachedExactly(std::uint32_t firstIteration) {
    return recorder_.record(optimiser_, firstIteration + done_).psnrBox >
           *plan_.psnr + kReachedMargin;
  }

  Optimiser& optimiser_;
  const FitTarget& target_;
  Recorder& recorder_;
  const RunPlan& plan_;
  KappaDescent& kappa_;
  std::uint32_t done_ = 0;
  double started_ = 0.0;
};

std::size_t firstCount(const RunPlan& plan, const Tuning& tuning) {
  const auto share = std::size_t(std::llround(tuning.firstShare * double(plan.count)));
  return std::clamp<std::size_t>(share, 1, plan.count);
}

/// How many ellipsoids the next stretch should aim at, from how many dB are missing.
std::size_t nextCount(std::size_t now, double missing, std::size_t largest) {
  const double factor = std::clamp(std::exp2(missing / kDbPerDoubling), kMinGrowth, kMaxGrowth);
  return std::min(largest, std::size_t(std::ceil(double(now) * factor)));
}

}  // namespace

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
           const Tuning& tuning) {
  Schedule schedule{firstCount(plan, tuning), plan.count, plan.iterations, tuning};
  RunEnd result{FitEnd::kScheduleDone, plan.firstIteration};
  KappaDescent kappa(tuning.kappaStep);
  for (;;) {
    Stretch stretch(optimiser, target, recorder, plan, kappa);
    result.end = stretch.run(schedule, result.iterations);
    result.iterations += stretch.iterations();
    if (result.end != FitEnd::kScheduleDone || !plan.psnr) return result;
    const double reached = recorder.record(optimiser, result.iterations).psnrBox;
    if (schedule.to >= plan.largestCount) {
      result.end = FitEnd::kPsnrMissed;
      return result;
    }
    schedule.from = optimiser.ellipsoidCount();
    schedule.to =
        std::max(schedule.from, nextCount(schedule.to, *plan.psnr - reached, plan.largestCount));
  }
}

}  // namespace esvr
