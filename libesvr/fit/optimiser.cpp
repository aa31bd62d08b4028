#include "fit/optimiser.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

#include "esvr/error.h"
#include "field/gather.h"

namespace esvr {
namespace {

constexpr int kListsStale = -1;
constexpr int kSmallestWindow = 2, kLargestWindow = 6;  // voxels

/// Voxels between neighbours if the primitives were spread evenly over the active voxels.
double spacing(const FitTarget& target, std::size_t primitives) {
  return std::cbrt(double(target.activeVoxels) / double(std::max<std::size_t>(primitives, 1)));
}

/// How much the sum of squares would grow if the primitive vanished:
/// sum (r - I phi)^2 - r^2 = I^2 sum phi^2 - 2 I sum r phi.
double removalError(const Primitive& p, const PrimitiveGradient& g) {
  return p.intensity * (p.intensity * g.phi2 - 2.0 * g.byParameter[kParameters - 1]);
}

/// Adds the seconds of its life to a sum.
class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum) {}
  ~Stopwatch() { sum_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& sum_;
  Clock::time_point start_ = Clock::now();
};

double energyOf(const FitTarget& target) {
  double sum = 0.0;
  for (const float v : target.values) sum += double(v) * double(v);
  return sum;
}

SignsAllowed signsOf(const FitTarget& target) {
  return {.positive = target.highest > 0.0, .negative = target.lowest < 0.0};
}

}  // namespace

Optimiser::Optimiser(const FitTarget& target, const OptimiserOptions& options, const Tuning& tuning)
    : target_(target),
      options_(options),
      tuning_(tuning),
      engine_(target, kernelConstants<double>(options.kernel)),
      trust_(energyOf(target)),
      unitVariance_(kernelVariance(engine_.kernel())),
      limits_{tuning.smallestScale, tuning.largestScale, tuning.intensityHeadroom * target.lowest,
              tuning.intensityHeadroom * target.highest} {}

void Optimiser::rebuildLists() {
  engine_.rebuild(primitives_, tuning_.listSlack);
  iterationsSinceRebuild_ = 0;
}

void Optimiser::refreshResiduals() {
  engine_.rebuild(primitives_, kRoundingSlack);
  engine_.residuals(primitives_, residuals_);
  iterationsSinceRebuild_ = kListsStale;
}

std::vector<Primitive> Optimiser::newSeeds(std::size_t count) {
  const Stopwatch watch(secondsSeeding_);
  refreshResiduals();
  trust_.forgetLoss();
  SeedOptions options;
  options.draw = {count, engine_.targetBricks(), signsOf(target_),
                  options_.seed ^ (++draws_ << 32)};
  const double distance = spacing(target_, std::max(count, primitives_.size()));
  options.window =
      std::clamp(int(std::lround(tuning_.seedWindow * distance)), kSmallestWindow, kLargestWindow);
  options.unitVariance = unitVariance_;
  options.intensity = tuning_.seedIntensity;
  return seedsFromResidual({engine_.index(), residuals_}, options);
}

void Optimiser::growTo(std::size_t count) {
  if (count <= primitives_.size()) return;
  const auto seeds = newSeeds(count - primitives_.size());
  primitives_.insert(primitives_.end(), seeds.begin(), seeds.end());
  states_.resize(primitives_.size());
  gradients_.resize(primitives_.size());
}

std::vector<std::size_t> Optimiser::leastUseful(std::size_t count) const {
  std::vector<std::pair<double, std::size_t>> settled;
  for (std::size_t i = 0; i < primitives_.size(); ++i)
    if (states_[i].steps >= std::uint32_t(tuning_.graceSteps))
      settled.emplace_back(removalError(primitives_[i], gradients_[i]), i);
  count = std::min(count, settled.size());
  std::nth_element(settled.begin(), settled.begin() + std::ptrdiff_t(count), settled.end());
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(settled[k].second);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void Optimiser::relocate(std::size_t count) {
  // What a removal costs is counted in squares, whatever loss is descended.
  if (options_.loss == Loss::kPaper) engine_.gradients(primitives_, gradients_);
  const auto chosen = leastUseful(count);
  if (chosen.empty()) return;
  const auto seeds = newSeeds(chosen.size());
  for (std::size_t k = 0; k < seeds.size(); ++k) {
    primitives_[chosen[k]] = seeds[k];
    states_[chosen[k]] = {};
  }
}

double Optimiser::takePaperGradients() {
  engine_.residuals(primitives_, residuals_);
  const PaperLossInput input{engine_.index(),   residuals_,    target_.values,
                             target_.boxVoxels, options_.beta, target_.highest - target_.lowest};
  paperLoss_.evaluate(input, lossByValue_);
  engine_.gradientsOf(primitives_, lossByValue_, gradients_);
  double squares = 0.0;
  for (const float r : residuals_) squares += double(r) * double(r);
  return squares;
}

double Optimiser::takeGradients() {
  if (options_.loss == Loss::kPaper) return takePaperGradients();
  return engine_.gradients(primitives_, gradients_);
}

double Optimiser::iterate(double scale) {
  if (iterationsSinceRebuild_ < 0 || iterationsSinceRebuild_ >= tuning_.rebuildEvery)
    rebuildLists();
  ++iterationsSinceRebuild_;
  const double loss = takeGradients();
  if (!std::isfinite(loss)) throw RuntimeFailure("the fit diverged: its loss is not finite");
  adamStep(primitives_, states_, gradients_, tuning_.steps.scaled(scale * trust_.update(loss)),
           tuning_.adam, limits_);
  return loss;
}

FitErrors Optimiser::measure() {
  refreshResiduals();
  FitErrors errors;
  for (std::size_t b = 0; b < engine_.brickCount(); ++b) {
    const float* r = residuals_.data() + b * kBrickVoxels;
    const bool inTarget = b < engine_.targetBricks();
    const Coord corner = engine_.index().bricks()[b] * kBrickSide;
    for (int v = 0; v < kBrickVoxels; ++v) {
      const double squared = double(r[v]) * double(r[v]);
      errors.squaredSum += squared;
      if (target_.box.contains(corner + voxelLocal(v))) errors.squaredSumBox += squared;
      errors.largest = std::max(errors.largest, std::abs(double(r[v])));
      if (inTarget && (*target_.active)[b].test(v)) errors.squaredSumActive += squared;
    }
  }
  return errors;
}

void Optimiser::dropUnseen() {
  if (primitives_.empty()) return;
  rebuildLists();
  engine_.gradients(primitives_, gradients_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < primitives_.size(); ++i)
    if (gradients_[i].phi2 > 0.0 && primitives_[i].intensity != 0.0)
      primitives_[kept++] = primitives_[i];
  primitives_.resize(kept);
  states_.resize(kept);
  gradients_.resize(kept);
  iterationsSinceRebuild_ = kListsStale;
}

}  // namespace esvr
