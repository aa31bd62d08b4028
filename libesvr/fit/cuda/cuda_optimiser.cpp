#include "fit/cuda/cuda_optimiser.h"

#include <algorithm>
#include <cmath>

#include "core/add_seconds.h"
#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "field/gather.h"
#include "fit/cpu/seed.h"
#include "fit/cuda/make_cuda_optimiser.h"
#include "fit/cuda/memory_plan.h"
#include "fit/cuda/memory_pool.h"
#include "fit/cuda/place_seeds.h"
#include "fit/scene.h"

namespace esvr {
namespace cuda {

CudaOptimiser::CudaOptimiser(const FitTarget& target, const OptimiserOptions& options,
                             const Tuning& tuning)
    : target_(target),
      options_(options),
      tuning_(tuning),
      bricks_(target.bricks, stream_.get()),
      lists_(stream_.get()),
      targetValues_(target.values, stream_.get()),
      active_(*target.active, stream_.get()),
      ellipsoids_(stream_.get()),
      adam_(stream_.get()),
      forms_(stream_.get()),
      usefulness_(stream_.get()),
      moments_(stream_.get()),
      residual_(stream_.get()),
      brickLoss_(stream_.get()),
      chunkSums_(stream_.get()),
      loss_(stream_.get()),
      slope_(stream_.get()),
      diverged_(1, stream_.get()),
      sampling_(stream_.get()),
      ranking_(stream_.get()),
      errorSums_(stream_.get()) {
  setKernel();
  loss_.reserve(1);
  slope_.reserve(1);
  diverged_.setZero();
}

void CudaOptimiser::setKernel() {
  kernel_ = kernelConstants<double>(options_.kernel);
  radius_ = supportRadius(kernel_);
  unitVariance_ = kernelVariance(kernel_);
}

BrickPassArguments CudaOptimiser::passArguments() {
  return {.scene = {.bricks = bricks_.view().bricks,
                    .brickCount = std::uint32_t(bricks_.size()),
                    .targetCount = std::uint32_t(bricks_.targetCount()),
                    .pairCount = std::uint32_t(lists_.pairCount()),
                    .lists = lists_.view(),
                    .forms = forms_.data()},
          .kernel = narrowed(kernel_),
          .target = {.values = targetValues_.data(),
                     .narrowBand = target_.narrowBand,
                     .lowest = float(target_.lowest),
                     .highest = float(target_.highest)},
          .brickLoss = brickLoss_.data(),
          .moments = moments_.data(),
          .residual = nullptr};
}

StepArguments CudaOptimiser::stepArguments(double factor) {
  return {.ellipsoidCount = std::uint32_t(count_),
          .sums = {.lists = lists_.view(),
                   .chunkCount = std::uint32_t(lists_.chunkCount()),
                   .moments = moments_.data(),
                   .chunkSums = chunkSums_.data()},
          .ellipsoids = ellipsoids_.data(),
          .states = adam_.data(),
          .forms = forms_.data(),
          .usefulness = usefulness_.data(),
          .diverged = diverged_.data(),
          .radius = radius_,
          .edge = {kernel_.slope, kernelWidth(kernel_).logMByKappa},
          .factor = factor,
          .sizes = tuning_.steps,
          .adam = tuning_.adam,
          .limits = limitsOf(target_, tuning_)};
}

void CudaOptimiser::rebuildLists(double slack) {
  const SupportSource supports{ellipsoids_.data(), count_, radius_, slack};
  if (!target_.narrowBand) bricks_.findReached(supports);
  lists_.rebuild(supports, bricks_);
  threads_.listsChanged();
  moments_.reserve(lists_.pairCount() * kMoments);
  chunkSums_.reserve(lists_.chunkCount() * kMoments);
  brickLoss_.reserve(bricks_.size());
  iterationsSinceRebuild_ = 0;
}

void CudaOptimiser::refreshResiduals() {
  rebuildLists(kRoundingSlack);
  BrickPassArguments pass = passArguments();
  pass.residual = residual_.reserve(bricks_.size() * kBrickVoxels);
  launchResiduals(pass, stream_.get());
  iterationsSinceRebuild_ = kListsStale;
}

void CudaOptimiser::reserve(std::size_t ellipsoids) {
  (void)count32(ellipsoids, "ellipsoids");
  ellipsoids_.extend(ellipsoids, count_);
  adam_.extend(ellipsoids, count_);
  forms_.extend(ellipsoids, count_);
  usefulness_.extend(ellipsoids, count_);
}

std::size_t CudaOptimiser::placeSeeds(std::size_t count, std::size_t ellipsoids,
                                      const std::uint32_t* into) {
  refreshResiduals();
  sumLoss();
  const double loss = downloadValue(loss_.data(), stream_.get());
  const DeviceSampling drawn = sampling_.draw(
      residual_.data(), loss, bricks_.view().bricks,
      {count, bricks_.targetCount(), signsOf(target_), options_.seed ^ (++samplings_ << 32)});
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

void CudaOptimiser::growTo(std::size_t count) {
  if (count <= count_) return;
  const AddSeconds timer(secondsSeeding_);
  requireMemory(target_, count, options_.maxDeviceBytes);
  reserve(count);
  count_ += placeSeeds(count - count_, std::max(count - count_, count_), nullptr);
  launchForms(ellipsoids_.data(), std::uint32_t(count_), radius_, forms_.data(), stream_.get());
}

void CudaOptimiser::relocate(std::size_t count) {
  const AddSeconds timer(secondsSeeding_);
  const auto chosen = ranking_.leastUseful(stepArguments(0.0), count, tuning_.graceSteps);
  if (chosen.count == 0) return;
  placeSeeds(chosen.count, count_, chosen.places);
  launchForms(ellipsoids_.data(), std::uint32_t(count_), radius_, forms_.data(), stream_.get());
}

void CudaOptimiser::takeGradients(std::optional<int> threads) {
  if (threads) return launchGradients(passArguments(), *threads, stream_.get());
  threads_.run(stream_.get(),
               [&](int best) { launchGradients(passArguments(), best, stream_.get()); });
}

void CudaOptimiser::sumLoss() {
  launchLossSum(brickLoss_.data(), std::uint32_t(bricks_.size()), loss_.data(), stream_.get());
}

void CudaOptimiser::step(double factor) {
  if (iterationsSinceRebuild_ < 0 || iterationsSinceRebuild_ >= tuning_.rebuildEvery)
    rebuildLists(tuning_.listSlack);
  ++iterationsSinceRebuild_;
  takeGradients();
  const StepArguments arguments = stepArguments(factor);
  sumLoss();
  launchMomentSums(arguments.sums, stream_.get());
  launchStep(arguments, stream_.get());
  stepped_ = count_;
}

double CudaOptimiser::iterate(std::span<const double> factors) {
  for (const double factor : factors) step(factor);
  const double loss = downloadValue(loss_.data(), stream_.get());
  if (!std::isfinite(loss) || downloadValue(diverged_.data(), stream_.get()) != 0)
    throw RuntimeFailure("the fit diverged: an ellipsoid is not finite");
  return loss;
}

double CudaOptimiser::kappaSlope() {
  launchEdgeSum(usefulness_.data(), std::uint32_t(stepped_), slope_.data(), stream_.get());
  return downloadValue(slope_.data(), stream_.get());
}

void CudaOptimiser::setKappa(float kappa) {
  const double before = kernelWidth(kernel_).m;
  options_.kernel.kappa = kappa;
  setKernel();
  launchShrink(ellipsoids_.data(), std::uint32_t(count_),
               std::sqrt(kernelWidth(kernel_).m / before), stream_.get());
  launchForms(ellipsoids_.data(), std::uint32_t(count_), radius_, forms_.data(), stream_.get());
  iterationsSinceRebuild_ = kListsStale;
}

FitErrors CudaOptimiser::measure() {
  refreshResiduals();
  return errorSums_.sum({.residual = residual_.data(),
                         .bricks = bricks_.view().bricks,
                         .active = active_.data(),
                         .brickCount = std::uint32_t(bricks_.size()),
                         .targetCount = std::uint32_t(bricks_.targetCount()),
                         .box = target_.box});
}

std::size_t CudaOptimiser::deviceBytes() const { return peakMemory(); }

std::vector<Ellipsoid> CudaOptimiser::ellipsoids() const {
  std::vector<Ellipsoid> host(count_);
  downloadTo(std::span<Ellipsoid>(host), ellipsoids_.data(), stream_.get());
  return host;
}

void CudaOptimiser::setEllipsoids(std::span<const Ellipsoid> ellipsoids) {
  count_ = 0;
  reserve(ellipsoids.size());
  count_ = ellipsoids.size();
  uploadTo(ellipsoids_.data(), ellipsoids, stream_.get());
  const std::vector<AdamState> fresh(count_);
  uploadTo(adam_.data(), std::span<const AdamState>(fresh), stream_.get());
  launchForms(ellipsoids_.data(), std::uint32_t(count_), radius_, forms_.data(), stream_.get());
  iterationsSinceRebuild_ = kListsStale;
}

std::vector<EllipsoidGradient> CudaOptimiser::gradients(int threads) {
  rebuildLists(tuning_.listSlack);
  takeGradients(threads);
  launchMomentSums(stepArguments(0.0).sums, stream_.get());
  DeviceBuffer<EllipsoidGradient> out(count_, stream_.get());
  launchReadGradients(stepArguments(0.0), out.data(), stream_.get());
  std::vector<EllipsoidGradient> host(count_);
  out.download(host);
  return host;
}

void CudaOptimiser::dropUnseen() {
  if (count_ == 0) return;
  const auto all = ellipsoids();
  const auto seen = gradients();
  std::vector<Ellipsoid> kept;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (seen[i].phi2 > 0.0 && all[i].intensity != 0.0) kept.push_back(all[i]);
  setEllipsoids(kept);
}

}  // namespace cuda

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                             const OptimiserOptions& options,
                                             const Tuning& tuning) {
  cuda::useDevice(options.device);
  cuda::keepFreedMemory();
  cuda::forgetPeakMemory();
  cuda::requireMemory(target, 1, options.maxDeviceBytes);
  return std::make_unique<cuda::CudaOptimiser>(target, options, tuning);
}

}  // namespace esvr
