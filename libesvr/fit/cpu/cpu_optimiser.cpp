#include "fit/cpu/cpu_optimiser.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/add_seconds.h"
#include "core/parallel.h"
#include "esvr/error.h"
#include "field/evaluate.h"
#include "fit/cpu/residual.h"
#include "fit/cuda/make_cuda.h"

namespace esvr {

std::unique_ptr<Optimiser> makeOptimiser(const FitTarget& target, const OptimiserOptions& options,
                                         const Tuning& tuning) {
  if (options.device.kind == DeviceKind::kCuda) return makeCudaOptimiser(target, options, tuning);
  return std::make_unique<CpuOptimiser>(target, options, tuning);
}

void adamStep(std::span<Ellipsoid> ellipsoids, std::span<AdamState> states,
              std::span<const EllipsoidGradient> gradients, const AdamStep& step) {
  const tbb::blocked_range<std::size_t> all(0, ellipsoids.size(), 64);
  parallelFor(all, [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      Ellipsoid& p = ellipsoids[i];
      const ParameterVector largest = largestStep(p, step.sizes);
      moveWithin(p, adamDirection(states[i], gradients[i].byParameter, step.options, largest),
                 step.limits);
    }
  });
}

CpuOptimiser::CpuOptimiser(const FitTarget& target, const OptimiserOptions& options,
                           const Tuning& tuning)
    : target_(target),
      options_(options),
      tuning_(tuning),
      kernel_(kernelConstants<double>(options.kernel)),
      pass_(target, kernel_),
      unitVariance_(kernelMoments(kernel_).variance),
      limits_(limitsOf(target, tuning)) {}

void CpuOptimiser::setEllipsoids(std::span<const Ellipsoid> ellipsoids) {
  ellipsoids_.assign(ellipsoids.begin(), ellipsoids.end());
  states_.assign(ellipsoids_.size(), {});
  gradients_.assign(ellipsoids_.size(), {});
  stale_ = true;
  loss_.reset();
}

void CpuOptimiser::setState(const FitState& state) {
  setEllipsoids(state.ellipsoids);
  states_ = state.adam;
  listed_.clear();
  for (const Ellipsoid& p : ellipsoids_) listed_.push_back(unlisted(p));
}

void CpuOptimiser::rebuildLists() {
  const double radius = supportRadius(kernel_);
  listed_.resize(ellipsoids_.size());
  parallelFor(std::size_t(0), ellipsoids_.size(), [&](std::size_t i) {
    listed_[i] = listedSupport(ellipsoids_[i], states_[i].steps, listed_[i], radius, tuning_.slack);
  });
  pass_.rebuild(listed_);
  refused_ = 0;
  stale_ = false;
}

/// Whether an ellipsoid is beyond what the lists hold.
bool CpuOptimiser::anyOutgrown() const {
  const double core = coreRadius(kernel_, tuning_.slack.missedShare);
  std::atomic<bool> any = false;
  parallelFor(std::size_t(0), ellipsoids_.size(), [&](std::size_t i) {
    if (!isHeld(listed_[i], ellipsoids_[i], core)) any = true;
  });
  return any;
}

/// Takes a step, within what the lists hold.
void CpuOptimiser::step(double factor) {
  const double core = coreRadius(kernel_, tuning_.slack.missedShare);
  const std::vector<Ellipsoid> before = ellipsoids_;
  adamStep(ellipsoids_, states_, gradients_,
           {.sizes = tuning_.steps.scaled(factor), .options = tuning_.adam, .limits = limits_});
  std::atomic<std::uint32_t> refused = 0;
  parallelFor(std::size_t(0), ellipsoids_.size(), [&](std::size_t i) {
    if (refuseStep(listed_[i], core, before[i], ellipsoids_[i])) ++refused;
  });
  refused_ += refused;
  stale_ = refused_ >= tuning_.slack.refusedSteps(ellipsoids_.size());
}

double CpuOptimiser::iterate(std::span<const double> factors) {
  double loss = 0.0;
  for (const double factor : factors) {
    if (stale_) rebuildLists();
    loss = loss_ ? *loss_ : pass_.gradients(ellipsoids_, gradients_);
    loss_.reset();
    if (!std::isfinite(loss)) throw RuntimeFailure("the fit diverged: its loss is not finite");
    step(factor);
  }
  return loss;
}

/// Lists that miss nothing, for residuals.
void CpuOptimiser::buildTightLists() {
  pass_.rebuild(ellipsoids_, kRoundingSlack);
  stale_ = true;
}

std::vector<Ellipsoid> CpuOptimiser::newSeeds(std::size_t count) {
  const AddSeconds timer(secondsSeeding_);
  if (stale_) buildTightLists();
  pass_.residuals(ellipsoids_, residuals_);
  stale_ = true;  // the caller adds or moves ellipsoids
  loss_.reset();
  SeedOptions options;
  options.draw = {count, target_.seedBricks, signsOf(target_),
                  options_.seed ^ (++samplings_ << 32)};
  options.window = seedWindow(target_, std::max(count, ellipsoids_.size()), tuning_);
  options.unitVariance = unitVariance_;
  options.intensity = tuning_.seedIntensity;
  return seedsFromResidual({pass_.index(), residuals_}, options);
}

void CpuOptimiser::growTo(std::size_t count) {
  if (count <= ellipsoids_.size()) return;
  const auto seeds = newSeeds(count - ellipsoids_.size());
  ellipsoids_.insert(ellipsoids_.end(), seeds.begin(), seeds.end());
  states_.resize(ellipsoids_.size());
  gradients_.resize(ellipsoids_.size());
}

std::vector<std::size_t> CpuOptimiser::leastUseful(std::size_t count) const {
  std::vector<std::pair<double, std::size_t>> settled;
  for (std::size_t i = 0; i < ellipsoids_.size(); ++i)
    if (states_[i].steps >= std::uint32_t(tuning_.graceSteps))
      settled.emplace_back(removalError(ellipsoids_[i].intensity, gradients_[i].phi2,
                                        gradients_[i].byParameter[kParameters - 1]),
                           i);
  count = std::min(count, settled.size());
  std::nth_element(settled.begin(), settled.begin() + std::ptrdiff_t(count), settled.end());
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < count; ++k) chosen.push_back(settled[k].second);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void CpuOptimiser::relocate(std::size_t count) {
  const auto chosen = leastUseful(count);
  if (chosen.empty()) return;
  const auto seeds = newSeeds(chosen.size());
  for (std::size_t k = 0; k < seeds.size(); ++k) {
    ellipsoids_[chosen[k]] = seeds[k];
    states_[chosen[k]] = {};
  }
}

FitErrors CpuOptimiser::measure() {
  buildTightLists();
  pass_.residuals(ellipsoids_, residuals_);
  return errorsOf(target_, {pass_.index(), residuals_});
}

FitErrors CpuOptimiser::measureBeforeIteration() {
  rebuildLists();
  loss_ = pass_.gradients(ellipsoids_, gradients_, &residuals_);
  return errorsOf(target_, {pass_.index(), residuals_});
}

double CpuOptimiser::kappaSlope() {
  double slope = 0.0;
  const double logMByKappa = kernelWidth(kernel_).logMByKappa;
  for (const EllipsoidGradient& g : gradients_) slope += edgeGradient(g, logMByKappa);
  return slope;
}

void CpuOptimiser::setKappa(float kappa) {
  const double before = kernelWidth(kernel_).m;
  options_.kernel.kappa = kappa;
  kernel_ = kernelConstants<double>(options_.kernel);
  pass_.setKernels(PassKernels(kernel_));
  unitVariance_ = kernelMoments(kernel_).variance;
  const double factor = std::sqrt(kernelWidth(kernel_).m / before);
  for (Ellipsoid& p : ellipsoids_) shrinkBy(p, factor);
  stale_ = stale_ || anyOutgrown();
  loss_.reset();
}

void CpuOptimiser::dropUnseen() {
  if (ellipsoids_.empty()) return;
  rebuildLists();
  pass_.gradients(ellipsoids_, gradients_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ellipsoids_.size(); ++i)
    if (gradients_[i].phi2 > 0.0 && ellipsoids_[i].intensity != 0.0)
      ellipsoids_[kept++] = ellipsoids_[i];
  ellipsoids_.resize(kept);
  states_.resize(kept);
  gradients_.resize(kept);
  stale_ = true;
  loss_.reset();
}

}  // namespace esvr
