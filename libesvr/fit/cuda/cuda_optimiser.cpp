#include "fit/cuda/cuda_optimiser.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/add_seconds.h"
#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "esvr/device.h"
#include "esvr/error.h"
#include "field/evaluate.h"
#include "fit/cuda/make_cuda.h"
#include "fit/cuda/memory_plan.h"

namespace esvr {

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                             const OptimiserOptions& options,
                                             const Tuning& tuning) {
  cuda::useDevice(options.device);
  cuda::requireMemory(target, 1, options.maxDeviceBytes);
  return std::make_unique<cuda::CudaOptimiser>(target, options, tuning);
}

std::shared_ptr<void> keepFreedMemory(const Device& device) {
  cuda::useDevice(device);
  return std::make_shared<cuda::KeepFreedMemory>();
}

bool fitsOnGpu(const FitSize& size, std::size_t ellipsoids, const Device& device,
               std::optional<std::size_t> maxBytes) {
  cuda::useDevice(device);
  return cuda::fitsInMemory(size, ellipsoids, maxBytes);
}

namespace cuda {
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

std::size_t CudaOptimiser::deviceBytes() const { return memory_.peak(); }

/// Does work that allocates memory. If memory runs out, the scratch memory is freed and the work is
/// done again.
template <class Work>
auto CudaOptimiser::withRoom(const Work& work) {
  try {
    return work();
  } catch (const DeviceMemoryError&) {
    releaseScratch();
  }
  return work();
}

/// Does the same, and drops ellipsoids until the memory suffices.
/// \throws DeviceMemoryError  the memory does not suffice for one ellipsoid
template <class Work>
auto CudaOptimiser::withFewer(const Work& work) {
  for (;;) {
    try {
      return withRoom(work);
    } catch (const DeviceMemoryError&) {
      if (count_ < 2) throw;
      dropLeastUseful();
    }
  }
}

// --- The ellipsoids.

std::vector<Ellipsoid> CudaOptimiser::ellipsoids() const {
  std::vector<Ellipsoid> host(count_);
  downloadTo(std::span<Ellipsoid>(host), ellipsoids_.data(), stream_.get());
  return host;
}

void CudaOptimiser::setEllipsoids(std::span<const Ellipsoid> ellipsoids) {
  count_ = stepped_ = 0;
  reserve(ellipsoids.size());
  count_ = ellipsoids.size();
  uploadTo(ellipsoids_.data(), ellipsoids, stream_.get());
  const std::vector<AdamState> fresh(count_);
  uploadTo(adam_.data(), std::span<const AdamState>(fresh), stream_.get());
  writeForms();
  stale_ = true;
}

void CudaOptimiser::setState(const FitState& state) {
  setEllipsoids(state.ellipsoids);
  uploadTo(adam_.data(), std::span<const AdamState>(state.adam), stream_.get());
  std::vector<ListedSupport> listed;
  for (const Ellipsoid& p : state.ellipsoids) listed.push_back(unlisted(p));
  uploadTo(listed_.data(), std::span<const ListedSupport>(listed), stream_.get());
}

FitState CudaOptimiser::state() const {
  FitState state{ellipsoids(), std::vector<AdamState>(count_)};
  downloadTo(std::span(state.adam), adam_.data(), stream_.get());
  return state;
}

// --- Passes and steps.

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

void ThreadsPerBrick::listsChanged(std::size_t passes) {
  constexpr std::size_t kPassesServed = 160;  // a measurement costs two slower passes
  tried_ = int(std::min(std::size_t(tried_), std::size_t(triedBefore_) + passes));
  triedBefore_ = tried_;
  if (tried_ != kChoices) return;
  if (measuring_) {
    std::array<double, kChoices> times{};
    for (int k = 0; k < kChoices; ++k)
      times[std::size_t(k)] =
          trials_[std::size_t(k)].end.millisecondsSince(trials_[std::size_t(k)].begin);
    best_ = int(std::min_element(times.begin(), times.end()) - times.begin());
  }
  served_ = measuring_ ? 0 : served_ + passes;
  measuring_ = served_ >= kPassesServed;
  if (measuring_) tried_ = triedBefore_ = 0;
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

std::vector<EllipsoidGradient> CudaOptimiser::gradients(int threads) {
  rebuildLists();
  launchGradients(passArguments(), threads, stream_.get());
  launchMomentSums(momentSums(), stream_.get());
  DeviceBuffer<EllipsoidGradient> out(count_, stream_.get());
  launchReadGradients(stepArguments(0.0, 0), out.data(), stream_.get());
  std::vector<EllipsoidGradient> host(count_);
  out.download(host);
  return host;
}

void CudaOptimiser::dropUnseen() {
  if (count_ == 0) return;
  setEllipsoids(withFewer([&] {
    const auto all = ellipsoids();
    const auto gradient = gradients();
    std::vector<Ellipsoid> seen;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (gradient[i].phi2 > 0.0 && all[i].intensity != 0.0) seen.push_back(all[i]);
    return seen;
  }));
}

// --- Growth and relocation.

void CudaOptimiser::reserve(std::size_t ellipsoids) {
  (void)count32(ellipsoids, "ellipsoids");
  ellipsoids_.extend(ellipsoids, count_);
  adam_.extend(ellipsoids, count_);
  forms_.extend(ellipsoids, count_);
  usefulness_.extend(ellipsoids, count_);
  listed_.extend(ellipsoids, count_);
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

void CudaOptimiser::grow(std::size_t count) {
  reserve(count);
  count_ += placeSeeds(count - count_, std::max(count - count_, count_), nullptr);
  writeForms();
}

void CudaOptimiser::growTo(std::size_t count) {
  if (count <= count_ || full_) return;
  const AddSeconds timer(secondsSeeding_);
  if (count_ == 0) requireMemory(target_, count, options_.maxDeviceBytes);
  const std::size_t affordable = affordableEllipsoids(target_, count, options_.maxDeviceBytes);
  full_ = affordable < count;
  if (affordable <= count_) return;
  try {
    withRoom([&] { grow(affordable); });
  } catch (const DeviceMemoryError&) {
    if (count_ == 0) throw;
    releaseScratch();
    std::vector<std::size_t> all(count_);
    std::iota(all.begin(), all.end(), std::size_t{0});
    keep(all);  // frees the memory that was reserved for the growth
  }
}

// --- When memory runs out.

/// Frees all memory whose contents can be computed again.
void CudaOptimiser::releaseScratch() {
  full_ = stale_ = true;
  lists_ = PairLists(stream_.get());
  sampling_ = VoxelSampling(stream_.get());
  ranking_ = EllipsoidRanking(stream_.get());
  errorSums_ = ErrorSums(stream_.get());
  for (auto* buffer : {&moments_, &residual_}) buffer->release();
  for (auto* buffer : {&brickLoss_, &chunkSums_}) buffer->release();
  trimMemoryPool();
}

/// Keeps the ellipsoids at these places, which must increase, together with their states, and frees
/// the memory of the others.
void CudaOptimiser::keep(std::span<const std::size_t> places) {
  const auto gather = [&]<class T>(GrowingBuffer<T>& buffer) {
    std::vector<T> all(count_), kept;
    downloadTo(std::span<T>(all), buffer.data(), stream_.get());
    for (const std::size_t i : places) kept.push_back(all[i]);
    buffer.release();
    uploadTo(buffer.reserve(kept.size()), std::span<const T>(kept), stream_.get());
  };
  gather(ellipsoids_);
  gather(adam_);
  gather(usefulness_);
  gather(listed_);
  forms_.release();
  forms_.reserve(places.size());
  stepped_ = std::size_t(std::lower_bound(places.begin(), places.end(), stepped_) - places.begin());
  count_ = places.size();
  writeForms();
  stale_ = true;
}

/// Drops the tenth of the ellipsoids whose removal adds the smallest error. New ellipsoids, which
/// have not taken a step yet, are dropped first.
void CudaOptimiser::dropLeastUseful() {
  constexpr std::size_t kShare = 10;
  const auto all = ellipsoids();
  std::vector<Usefulness> usefulness(stepped_);
  downloadTo(std::span(usefulness), usefulness_.data(), stream_.get());
  std::vector<double> worth(count_, 0.0);
  for (std::size_t i = 0; i < stepped_; ++i)
    worth[i] =
        removalError(all[i].intensity, double(usefulness[i].phi2), double(usefulness[i].rPhi));
  keep(allButLowest(worth, count_ / kShare + 1));
}

}  // namespace cuda
}  // namespace esvr
