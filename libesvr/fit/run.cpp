#include "fit/run.h"

#include <algorithm>
#include <cmath>

#include "esvr/error.h"

namespace esvr {

double psnrOf(double squaredSum, double voxels, double peak) {
  if (squaredSum <= 0.0) return kPerfectPsnr;
  return std::min(kPerfectPsnr, 10.0 * std::log10(peak * peak * voxels / squaredSum));
}

double Recorder::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

const TimedCurvePoint& Recorder::record(const FitErrors& errors, std::size_t ellipsoids,
                                        std::uint32_t iteration) {
  TimedCurvePoint point;
  point.seconds = seconds();
  point.iteration = iteration;
  point.ellipsoids = ellipsoids;
  point.psnrBox = psnrOf(errors.squaredSumBox, target_.boxVoxels, target_.peak);
  point.psnrActive = psnrOf(errors.squaredSumActive, double(target_.activeVoxels), target_.peak);
  point.maxError = errors.largest / target_.scale;
  curve_.push_back(point);
  return curve_.back();
}

void Recorder::report(const TimedCurvePoint& now, double fraction) {
  constexpr double kInterval = 0.25;  // seconds
  if (!options_.progress || now.seconds - lastReport_ < kInterval) return;
  lastReport_ = now.seconds;
  FitProgress progress{.point = now, .fraction = fraction};
  addRates(progress, target_.activeVoxels);
  options_.progress(progress);
}

void addRates(FitProgress& progress, std::uint64_t activeVoxels) {
  const double seconds = progress.point.seconds, fraction = progress.fraction;
  if (seconds <= 0.0 || fraction <= 0.0) return;
  progress.secondsLeft = seconds * (1.0 - fraction) / fraction;
  progress.voxelsPerSecond = double(activeVoxels) * fraction / seconds;
}

float KappaDescent::next(float kappa, double slope, double factor) {
  // The averages are short, because there are few steps and every relocation changes the slope.
  constexpr double kBeta1 = 0.7, kBeta2 = 0.9;
  if (slope == 0.0) return kappa;
  mean_ = kBeta1 * mean_ + (1.0 - kBeta1) * slope;
  square_ = kBeta2 * square_ + (1.0 - kBeta2) * slope * slope;
  meanWeight_ = kBeta1 * meanWeight_ + (1.0 - kBeta1);
  squareWeight_ = kBeta2 * squareWeight_ + (1.0 - kBeta2);
  const double direction = mean_ / meanWeight_ / std::sqrt(square_ / squareWeight_);
  return float(std::clamp(kappa - factor * largestStep_ * direction, kSmoothest, kHardest));
}

void applyOptions(const FitOptions& options, FitTarget& target) {
  target.saturates = true;
  target.narrowBand = options.narrowBand;
  target.bothSigns = options.bothSigns.value_or(false);
}

float firstKappa(const FitOptions& options, const Tuning& tuning) {
  if (options.kappa) return *options.kappa;
  return options.start ? options.start->kernel.kappa : tuning.firstKappa;
}

std::size_t firstSeeds(std::size_t count, const Tuning& tuning) {
  const auto share = std::size_t(std::llround(tuning.firstShare * double(count)));
  return std::clamp<std::size_t>(share, 1, count);
}

bool anyNegative(std::span<const Ellipsoid> ellipsoids) {
  return std::any_of(ellipsoids.begin(), ellipsoids.end(),
                     [](const Ellipsoid& p) { return p.intensity < 0.0; });
}

FitResult emptyFit(const SparseVolume& volume, float kappa) {
  FitResult result;
  result.field.background = volume.background;
  result.field.kernel.kappa = kappa;
  result.range = {volume.background, volume.background};
  TimedCurvePoint point;
  point.psnrBox = point.psnrActive = kPerfectPsnr;
  result.curve.push_back(point);
  return result;
}

namespace {

constexpr std::uint32_t kCurvePoints = 32;
constexpr double kReachedMargin = 1e-3;  // dB, more than the rounding to float32 can cost

class FitRun {
 public:
  FitRun(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
         const Tuning& tuning)
      : optimiser_(optimiser),
        target_(target),
        recorder_(recorder),
        plan_(plan),
        schedule_{plan.firstCount, plan.count, plan.iterations, tuning},
        kappa_(tuning.kappaStep),
        first_(iterationAt(plan.from)),
        last_(iterationAt(plan.to)),
        done_(first_) {}

  RunEnd run() {
    if (!plan_.start.ellipsoids.empty()) optimiser_.setState(plan_.start);
    return {iterateUnlessCancelled(), done_};
  }

 private:
  /// A cancellation may end an iteration between two of its passes. The ellipsoids then are those before
  /// its step, or some of them those after it.
  FitEnd iterateUnlessCancelled() try { return iterateToEnd(); } catch (const Cancelled&) {
    return FitEnd::kCancelled;
  }

  FitEnd iterateToEnd() {
    while (!finished()) {
      if (recorder_.cancelled()) return FitEnd::kCancelled;
      if (isEvent() && !isDoneBefore()) events();
      if (plan_.curve && done_ % recordInterval() == 0) record(optimiser_.measureBeforeIteration());
      const double psnr = psnrOf(iterate(), target_.boxVoxels, target_.peak);
      report(psnr);
      if (plan_.psnr && psnr > *plan_.psnr && reachedExactly()) return FitEnd::kPsnrReached;
    }
    // There are gradients now, and none at the start of the next part.
    if (plan_.to < 1.0 && isEvent()) events();
    return endOfSchedule();
  }

  [[nodiscard]] bool isEvent() const { return done_ % schedule_.eventInterval() == 0; }
  /// Whether the part before has ended with the event of this iteration.
  [[nodiscard]] bool isDoneBefore() const { return done_ == first_ && plan_.from > 0.0; }

  FitEnd endOfSchedule() {
    if (plan_.seconds) return FitEnd::kTimeUp;
    if (!plan_.psnr) return FitEnd::kScheduleDone;
    return reachedExactly() ? FitEnd::kPsnrReached : FitEnd::kPsnrMissed;
  }

  /// The fraction of the run that is done after `ahead` more iterations.
  [[nodiscard]] double fractionDone(std::uint32_t ahead = 0) const {
    if (!plan_.seconds) return double(done_ + ahead) / schedule_.iterations;
    const double share = std::min(1.0, recorder_.seconds() / *plan_.seconds);
    return plan_.from + share * (plan_.to - plan_.from);
  }
  [[nodiscard]] bool finished() const {
    return plan_.seconds ? fractionDone() >= plan_.to : done_ >= last_;
  }
  [[nodiscard]] std::uint32_t iterationAt(double fraction) const {
    return std::uint32_t(std::lround(fraction * schedule_.iterations));
  }
  [[nodiscard]] std::uint32_t recordInterval() const {
    return std::max(schedule_.eventInterval(), schedule_.iterations / kCurvePoints);
  }

  /// Iterates until the next event or record. \return sum of r^2 before the last step
  double iterate() {
    const auto until = [&](std::uint32_t interval) { return interval - done_ % interval; };
    std::uint32_t count = std::min(
        {optimiser_.batchSize(), until(schedule_.eventInterval()), until(recordInterval())});
    if (!plan_.seconds) count = std::min(count, last_ - done_);
    std::vector<double> factors;
    for (std::uint32_t k = 0; k < count; ++k)
      factors.push_back(schedule_.stepAt(fractionDone(k), done_ + k));
    done_ += count;
    return optimiser_.iterate(factors);
  }

  void descendKappa(double factor) {
    const float now = optimiser_.kernel().kappa;
    const float next = kappa_.next(now, optimiser_.kappaSlope(), factor);
    if (next != now) optimiser_.setKappa(next);
  }

  void events() {
    const double fraction = fractionDone();
    if (plan_.learnKappa && done_ > first_) descendKappa(schedule_.stepAt(fraction, done_));
    if (done_ > first_)  // there are no gradients before
      optimiser_.relocate(schedule_.relocationsAt(fraction, optimiser_.ellipsoidCount()));
    optimiser_.growTo(schedule_.countAt(fraction));
  }

  void report(double psnr) {
    TimedCurvePoint now;
    now.seconds = recorder_.seconds();
    now.iteration = done_;
    now.ellipsoids = optimiser_.ellipsoidCount();
    now.psnrBox = psnr;
    recorder_.report(now, fractionDone());
  }

  const TimedCurvePoint& record(const FitErrors& errors) {
    return recorder_.record(errors, optimiser_.ellipsoidCount(), done_);
  }

  /// Measures the errors now; the loss of an iteration is that before its step.
  bool reachedExactly() {
    return record(optimiser_.measure()).psnrBox > *plan_.psnr + kReachedMargin;
  }

  Optimiser& optimiser_;
  const FitTarget& target_;
  Recorder& recorder_;
  const RunPlan& plan_;
  Schedule schedule_;
  KappaDescent kappa_;
  std::uint32_t first_, last_;  ///< iterations at the ends of the part
  std::uint32_t done_;
};

}  // namespace

RunEnd run(Optimiser& optimiser, const FitTarget& target, Recorder& recorder, const RunPlan& plan,
           const Tuning& tuning) {
  return FitRun(optimiser, target, recorder, plan, tuning).run();
}

}  // namespace esvr
