#include "fit/cuda/cuda_optimiser.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/add_seconds.h"
#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "esvr/progress.h"
#include "field/gather.h"
#include "fit/cuda/least_useful.h"
#include "fit/cuda/make_cuda_optimiser.h"
#include "fit/cuda/memory_plan.h"
#include "fit/cuda/place_seeds.h"
#include "fit/kernel_moments.h"
#include "fit/motion_bound.h"
#include "fit/scene.h"

namespace esvr::cuda {
namespace {

/// Seconds for which the steps that are started at once may take. A cancellation waits for them.
constexpr double kLongestWait = 0.2;

}  // namespace

CudaOptimiser::CudaOptimiser(const FitTarget& target, const OptimiserOptions& options,
                             const Tuning& tuning)
    : target_(target),
      options_(options),
      tuning_(tuning),
      memory_(options.maxDeviceBytes.value_or(MemoryAccount::kNoLimit)),
      bricks_(target.bricks, stream_.get()),
      lists_(stream_.get()),
      targetValues_(target.values, stream_.get()),
      constants_(target.constants, stream_.get()),
      active_(*target.active, stream_.get()),
      ellipsoids_(stream_.get()),
      adam_(stream_.get()),
      forms_(stream_.get()),
      usefulness_(stream_.get()),
      listed_(stream_.get()),
      moments_(stream_.get()),
      residual_(stream_.get()),
      brickLoss_(stream_.get()),
      chunkSums_(stream_.get()),
      slope_(stream_.get()),
      status_(1, stream_.get()),
      sampling_(stream_.get()),
      ranking_(stream_.get()),
      errorSums_(stream_.get()) {
  setKernel();
  slope_.reserve(1);
  status_.setZero();
}

void CudaOptimiser::setKernel() {
  kernel_ = kernelConstants<double>(options_.kernel);
  radius_ = supportRadius(kernel_);
  unitVariance_ = kernelMoments(kernel_).variance;
}

BrickPassArguments CudaOptimiser::passArguments() {
  return {.scene = passScene(bricks_, lists_, count_, forms_.data()),
          .kernel = narrowed(kernel_),
          .target = {.values = targetValues_.data(),
                     .constants = target_.constants.empty() ? nullptr : constants_.data(),
                     .bricks = std::uint32_t(bricks_.targetCount()),
                     .saturates = target_.saturates,
                     .lowest = float(target_.lowest),
                     .highest = float(target_.highest)},
          .brickLoss = brickLoss_.data(),
          .moments = moments_.data(),
          .residual = nullptr,
          .halted = nullptr};
}

MomentSums CudaOptimiser::momentSums() {
  return {.lists = lists_.view(),
          .chunkCount = std::uint32_t(lists_.chunkCount()),
          .moments = moments_.data(),
          .chunkSums = chunkSums_.data(),
          .halted = nullptr};
}

/// \param n  number of steps that were started since the last call of look()
StepArguments CudaOptimiser::stepArguments(double factor, std::size_t n) {
  StepStatus* const status = status_.data();
  return {.ellipsoidCount = std::uint32_t(count_),
          .sums = momentSums(),
          .ellipsoids = ellipsoids_.data(),
          .states = adam_.data(),
          .forms = forms_.data(),
          .usefulness = usefulness_.data(),
          .diverged = &status->diverged,
          .radius = radius_,
          .edge = {kernel_.slope, kernelWidth(kernel_).logMByKappa},
          .factor = factor,
          .sizes = tuning_.steps,
          .adam = tuning_.adam,
          .limits = limitsOf(target_, tuning_),
          .listed = listed_.data(),
          .core = coreRadius(kernel_, tuning_.slack.missedShare),
          .refused = &status->refused,
          .maxRefused = tuning_.slack.refusedSteps(count_),
          .halted = &status->halted[n],
          .halts = &status->halted[n + 1]};
}

void CudaOptimiser::writeForms() {
  launchForms({.ellipsoids = ellipsoids_.data(),
               .count = std::uint32_t(count_),
               .radius = radius_,
               .forms = forms_.data()},
              stream_.get());
}

void CudaOptimiser::buildLists(const SupportSource& supports) {
  if (!target_.narrowBand)
    bricks_.findReached(supports, target_.within.value_or(bricksOf(Box::whole())));
  lists_.rebuild(supports, bricks_);
  moments_.reserve(lists_.pairCount() * kMoments);
  chunkSums_.reserve(lists_.chunkCount() * kMoments);
  brickLoss_.reserve(bricks_.size());
}

/// Builds the lists for the following steps, and clears their halt flags.
void CudaOptimiser::rebuildLists() {
  launchListing({.count = std::uint32_t(count_),
                 .ellipsoids = ellipsoids_.data(),
                 .states = adam_.data(),
                 .listed = listed_.data(),
                 .radius = radius_,
                 .rule = tuning_.slack},
                stream_.get());
  buildLists({.ellipsoids = nullptr,
              .count = count_,
              .radius = radius_,
              .slack = kRoundingSlack,
              .listed = listed_.data()});
  status_.setZero();
  threads_.listsChanged(served_);
  served_ = 0;
  stale_ = false;
}

/// Lists that miss nothing, for residuals.
void CudaOptimiser::buildTightLists() {
  stale_ = true;
  buildLists({.ellipsoids = ellipsoids_.data(),
              .count = count_,
              .radius = radius_,
              .slack = kRoundingSlack});
}

void CudaOptimiser::writeResiduals() {
  BrickPassArguments pass = passArguments();
  pass.residual = residual_.reserve(bricks_.size() * kBrickVoxels);
  launchResiduals(pass, stream_.get());
}

std::size_t CudaOptimiser::placeSeeds(std::size_t count, std::size_t ellipsoids,
                                      const std::uint32_t* into) {
  if (stale_) buildTightLists();
  stale_ = true;  // the caller adds or moves ellipsoids
  writeResiduals();
  sumLoss();
  const double loss = downloadValue(&status_.data()->loss, stream_.get());
  const DeviceSampling drawn = sampling_.draw(
      residual_.data(), loss, bricks_.view().bricks,
      {count, target_.seedBricks, signsOf(target_), options_.seed ^ (++samplings_ << 32)});
  launchPlaceSeeds({.voxels = drawn.voxels,
                    .count = drawn.count,
                    .bricks = bricks_.view(),
                    .residual = residual_.data(),
                    .window = seedWindow(target_, ellipsoids, tuning_),
                    .unitVariance = unitVariance_,
                    .intensity = tuning_.seedIntensity,
                    .share = drawn.share,
                    .into = into,
                    .firstPlace = std::uint32_t(count_),
                    .ellipsoids = ellipsoids_.data(),
                    .states = adam_.data()},
                   stream_.get());
  return drawn.count;
}

void CudaOptimiser::relocate(std::size_t count) {
  const AddSeconds timer(secondsSeeding_);
  withFewer([&] {
    const auto chosen = ranking_.leastUseful(stepArguments(0.0, 0), count, tuning_.graceSteps);
    if (chosen.count == 0) return;
    placeSeeds(chosen.count, count_, chosen.places);
    writeForms();
  });
}

void CudaOptimiser::sumLoss() {
  launchLossSum(brickLoss_.data(), std::uint32_t(bricks_.size()), &status_.data()->loss,
                stream_.get());
}

/// Starts a step. \param n  number of steps that were started since the last call of look()
void CudaOptimiser::step(double factor, std::size_t n) {
  StepArguments arguments = stepArguments(factor, n);
  BrickPassArguments pass = passArguments();
  pass.halted = arguments.sums.halted = arguments.halted;
  threads_.run(stream_.get(), [&](int best) { launchGradients(pass, best, stream_.get()); });
  launchMomentSums(arguments.sums, stream_.get());
  launchStep(arguments, stream_.get());
}

/// Waits for the started steps and reads their status. \return how many of them were taken
std::size_t CudaOptimiser::look(std::size_t started) {
  sumLoss();
  const StepStatus status = downloadValue(status_.data(), stream_.get());
  if (!std::isfinite(status.loss) || status.diverged != 0)
    throw RuntimeFailure("the fit diverged: an ellipsoid is not finite");
  const std::size_t taken = status.taken(started);
  loss_ = status.loss;
  stepped_ = count_;
  served_ += taken;
  stale_ = !status.canGoOn(started);
  ahead_ = std::min(stale_ ? served_ : 2 * ahead_, StepStatus::kMaxAhead);
  return taken;
}

double CudaOptimiser::iterate(std::span<const double> factors) {
  while (!factors.empty()) {
    CancelScope::check();
    if (stale_) withFewer([&] { rebuildLists(); });
    const std::size_t started = std::min(factors.size(), ahead_);
    double seconds = 0.0;
    {
      const AddSeconds timer(seconds);
      for (std::size_t n = 0; n < started; ++n) step(factors[n], n);
      factors = factors.subspan(look(started));
    }
    // The steps do not depend on how many are started at once.
    if (seconds > kLongestWait)
      ahead_ = std::max<std::size_t>(std::size_t(double(started) * kLongestWait / seconds), 1);
  }
  return loss_;
}

double CudaOptimiser::kappaSlope() {
  launchEdgeSum(usefulness_.data(), std::uint32_t(stepped_), slope_.data(), stream_.get());
  return downloadValue(slope_.data(), stream_.get());
}

void CudaOptimiser::setKappa(float kappa) {
  const double before = kernelWidth(kernel_).m;
  options_.kernel.kappa = kappa;
  setKernel();
  launchShrink({.count = std::uint32_t(count_),
                .ellipsoids = ellipsoids_.data(),
                .factor = std::sqrt(kernelWidth(kernel_).m / before),
                .listed = stale_ ? nullptr : listed_.data(),
                .core = coreRadius(kernel_, tuning_.slack.missedShare),
                .halts = status_.data()->halted},
               stream_.get());
  writeForms();
  stale_ = stale_ || downloadValue(status_.data()->halted, stream_.get()) != 0;
}

FitErrors CudaOptimiser::measure() {
  return withFewer([&] {
    buildTightLists();
    writeResiduals();
    return errorSums_.sum({.residual = residual_.data(),
                           .bricks = bricks_.view().bricks,
                           .active = active_.data(),
                           .brickCount = std::uint32_t(bricks_.size()),
                           .targetCount = std::uint32_t(bricks_.targetCount()),
                           .box = target_.box});
  });
}

}  // namespace esvr::cuda
