#include "fit/run.h"

#include <algorithm>
#include <cmath>

namespace esvr {
namespace {

constexpr std::uint32_t kCurvePoints = 32;  // of one stretch
constexpr double kDbPerDoubling = 5.0;      // typical: sizes the next stretch of a --psnr run
constexpr double kLeastGrowth = 1.2, kMostGrowth = 3.0;
constexpr double kReachedMargin = 1e-3;  // dB: float32 storage must not undo it

/// One stretch of iterations with its own schedule.
class Stretch {
 public:
  Stretch(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan)
      : optimiser_(optimiser), target_(target), recorder_(recorder), plan_(plan) {}

  /// \return why it ended; kScheduleDone when it ran to its end
  FitEnd run(const Schedule& schedule, std::uint32_t firstIteration) {
    started_ = recorder_.seconds();
    for (done_ = 0; !finished(schedule); ++done_) {
      if (recorder_.cancelled()) return FitEnd::kCancelled;
      const double fraction = fractionDone(schedule);
      if (done_ % schedule.eventInterval() == 0) events(schedule, fraction);
      if (done_ % recordInterval(schedule) == 0)
        recorder_.record(optimiser_, firstIteration + done_);
      const double loss = optimiser_.iterate(schedule.stepAt(fraction, done_));
      const double psnr = psnrOf(loss, target_.boxVoxels, target_.peak);
      report(psnr, firstIteration, fraction);
      if (plan_.psnr && psnr > *plan_.psnr && reachedExactly(firstIteration))
        return FitEnd::kPsnrReached;
    }
    return plan_.seconds ? FitEnd::kTimeUp : FitEnd::kScheduleDone;
  }
  [[nodiscard]] std::uint32_t iterations() const { return done_; }

 private:
  [[nodiscard]] double fractionDone(const Schedule& schedule) const {
    const double byCount = double(done_) / schedule.iterations;
    if (!plan_.seconds) return byCount;
    const double left = *plan_.seconds - started_;
    return left > 0.0 ? std::min(1.0, (recorder_.seconds() - started_) / left) : 1.0;
  }
  [[nodiscard]] bool finished(const Schedule& schedule) const {
    return plan_.seconds ? fractionDone(schedule) >= 1.0 : done_ >= schedule.iterations;
  }
  static std::uint32_t recordInterval(const Schedule& schedule) {
    return std::max(schedule.eventInterval(), schedule.iterations / kCurvePoints);
  }

  void events(const Schedule& schedule, double fraction) {
    if (done_ > 0)
      optimiser_.relocate(schedule.relocationsAt(fraction, optimiser_.primitives().size()));
    optimiser_.growTo(schedule.countAt(fraction));
  }

  void report(double psnr, std::uint32_t firstIteration, double fraction) {
    CurvePoint now;
    now.seconds = recorder_.seconds();
    now.iteration = firstIteration + done_;
    now.primitives = optimiser_.primitives().size();
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
  std::uint32_t done_ = 0;
  double started_ = 0.0;
};

std::size_t firstCount(const RunPlan& plan, const Tuning& tuning) {
  const auto share = std::size_t(std::llround(tuning.firstShare * double(plan.count)));
  return std::clamp<std::size_t>(share, 1, plan.count);
}

/// How many primitives the next stretch should aim at, from how many dB are missing.
std::size_t nextCount(std::size_t now, double missing, std::size_t largest) {
  const double factor = std::clamp(std::exp2(missing / kDbPerDoubling), kLeastGrowth, kMostGrowth);
  return std::min(largest, std::size_t(std::ceil(double(now) * factor)));
}

}  // namespace

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan) {
  const Tuning& tuning = optimiser.tuning();
  Schedule schedule{firstCount(plan, tuning), plan.count, plan.iterations, tuning};
  RunEnd result{FitEnd::kScheduleDone, 0};
  for (;;) {
    Stretch stretch(optimiser, target, recorder, plan);
    result.end = stretch.run(schedule, result.iterations);
    result.iterations += stretch.iterations();
    if (result.end != FitEnd::kScheduleDone || !plan.psnr) return result;
    const double reached = recorder.record(optimiser, result.iterations).psnrBox;
    if (schedule.to >= plan.largestCount) {
      result.end = FitEnd::kPsnrMissed;
      return result;
    }
    schedule.from = optimiser.primitives().size();
    schedule.to =
        std::max(schedule.from, nextCount(schedule.to, *plan.psnr - reached, plan.largestCount));
  }
}

}  // namespace esvr
