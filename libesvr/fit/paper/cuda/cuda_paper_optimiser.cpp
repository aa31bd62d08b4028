#include "fit/paper/cuda/cuda_paper_optimiser.h"

#include <algorithm>
#include <utility>

#include "core/cuda/copy.h"
#include "core/cuda/count32.h"
#include "core/cuda/use_device.h"
#include "esvr/error.h"
#include "field/gather.h"
#include "fit/cuda/memory_plan.h"
#include "fit/paper/cuda/make_cuda_paper_optimiser.h"
#include "fit/scene.h"

namespace esvr {
namespace cuda {

namespace {

double windowBytes(const FitTarget& target) {
  constexpr double kWithReached = 2.0;  // estimate: as many reached bricks as target bricks
  return PaperLoss::bytesFor(kWithReached * double(target.bricks.size()));
}

}  // namespace

CudaPaperOptimiser::Part::Part(std::unique_ptr<paper::Subvolume> from, bool visitOnly,
                               cudaStream_t stream)
    : volume(std::move(from)),
      bricks(volume->target.bricks, stream),
      windows({}, stream),
      lists(stream) {
  if (!visitOnly) values = DeviceBuffer<float>(volume->target.values, stream);
}

CudaPaperOptimiser::CudaPaperOptimiser(const FitTarget& target, const paper::PaperOptions& options)
    : target_(target),
      options_(options),
      kernel_(kernelOf(options.kind)),
      constants_(kernelConstants<double>(kernel_)),
      ellipsoids_(stream_.get()),
      states_(stream_.get()),
      units_(stream_.get()),
      forms_(stream_.get()),
      kernels_(stream_.get()),
      radii_(stream_.get()),
      moments_(stream_.get()),
      residual_(stream_.get()),
      visited_(stream_.get()),
      active_(stream_.get()),
      chunkSums_(stream_.get()),
      diverged_(1, stream_.get()),
      errorSums_(stream_.get()),
      loss_(stream_.get()) {
  diverged_.setZero();
  for (auto& volume : paper::cutSubvolumes(target, paper::spaceOf(target), options.subvolumeSide))
    parts_.push_back(std::make_unique<Part>(std::move(volume), options.visitOnly, stream_.get()));
}

PaperEllipsoids CudaPaperOptimiser::ellipsoids() {
  const bool own = options_.kind.learnK;
  return {.count = std::uint32_t(count_),
          .kind = options_.kind,
          .kernel = kernel_,
          .constants = constants_,
          .ellipsoids = ellipsoids_.data(),
          .states = states_.data(),
          .units = units_.data(),
          .forms = forms_.data(),
          .kernels = own ? kernels_.data() : nullptr,
          .radii = own ? radii_.data() : nullptr,
          .diverged = diverged_.data()};
}

PaperPassArguments CudaPaperOptimiser::passArguments(const Part& part) {
  return {.scene = passScene(part.bricks, part.lists, count_, forms_.data()),
          .kernel = narrowed(constants_),
          .kernels = ellipsoids().kernels,
          .target = {.values = values_,
                     .constants = nullptr,
                     .bricks = std::uint32_t(part.bricks.targetCount()),
                     .saturates = false,
                     .lowest = float(target_.lowest),
                     .highest = float(target_.highest)},
          .residual = residual_.data(),
          .lossByValue = nullptr,
          .moments = moments_.data()};
}

MomentSums CudaPaperOptimiser::momentSums(const Part& part) {
  return {.lists = part.lists.view(),
          .chunkCount = std::uint32_t(part.lists.chunkCount()),
          .moments = moments_.data(),
          .chunkSums = chunkSums_.data()};
}

void CudaPaperOptimiser::rebuildLists(Part& part, double slack) {
  const SupportSource supports{units_.data(), count_, supportRadius(constants_), slack,
                               ellipsoids().radii};
  const Box within = *part.volume->target.within;
  part.bricks.findReached(supports, within);
  part.lists.rebuild(supports, part.bricks);
  part.windows.findAround(part.bricks, within);
  part.motionLeft = slack;
}

/// Sets values_ to the target's values of a subvolume, which are in device memory from the start or
/// are uploaded for this visit.
void CudaPaperOptimiser::bring(const Part& part) {
  values_ = part.values.data();
  const std::span<const float> values(part.volume->target.values);
  if (!options_.visitOnly || values.empty()) return;
  uploadTo(visited_.reserve(values.size()), values, stream_.get());
  values_ = visited_.data();
}

/// Computes the residuals of a subvolume. All subvolumes use the same buffers in turn.
void CudaPaperOptimiser::takeResiduals(Part& part) {
  moments_.reserve(part.lists.pairCount() * kMoments);
  chunkSums_.reserve(part.lists.chunkCount() * kMoments);
  residual_.reserve(part.bricks.size() * kBrickVoxels);
  bring(part);
  launchPaperResiduals(passArguments(part), stream_.get());
}

void CudaPaperOptimiser::takeGradients(Part& part) {
  takeResiduals(part);
  PaperPassArguments pass = passArguments(part);
  pass.lossByValue = loss_.derivative({.bricks = part.bricks,
                                       .windows = part.windows,
                                       .residual = residual_.data(),
                                       .target = values_,
                                       .targetBricks = part.bricks.targetCount(),
                                       .voxels = part.volume->target.boxVoxels,
                                       .beta = options_.beta,
                                       .peak = target_.highest - target_.lowest});
  launchPaperMoments(pass, stream_.get());
  launchMomentSums(momentSums(part), stream_.get());
}

void CudaPaperOptimiser::iterate(std::size_t subvolume, const paper::PaperStep& step) {
  Part& part = *parts_[subvolume];
  if (part.motionLeft < 0.0) rebuildLists(part, paper::kListSlack);
  takeGradients(part);
  launchPaperStep(ellipsoids(), momentSums(part), step, stream_.get());
  for (auto& each : parts_) each->motionLeft -= paper::motionOf(step);
}

void CudaPaperOptimiser::requireMemoryFor(std::size_t count) const {
  const auto fullest = std::max_element(parts_.begin(), parts_.end(), [](auto& a, auto& b) {
    return a->volume->target.bricks.size() < b->volume->target.bricks.size();
  });
  const FitTarget& largest = (*fullest)->volume->target;
  const FitTarget& held = options_.visitOnly ? largest : target_;
  requireMemory(held, count, options_.maxDeviceBytes, windowBytes(largest));
}

void CudaPaperOptimiser::put(const paper::Population& population) {
  requireMemoryFor(population.size());
  count_ = count32(population.size(), "ellipsoids");
  uploadTo(ellipsoids_.reserve(count_), std::span(population.ellipsoids), stream_.get());
  uploadTo(states_.reserve(count_), std::span(population.states), stream_.get());
  units_.reserve(count_);
  forms_.reserve(count_);
  if (options_.kind.learnK) {
    kernels_.reserve(count_);
    radii_.reserve(count_);
  }
  launchPaperForms(ellipsoids(), stream_.get());
  for (auto& part : parts_) part->motionLeft = -1.0;
}

paper::Population CudaPaperOptimiser::population() const {
  paper::Population population;
  population.ellipsoids.resize(count_);
  population.states.resize(count_);
  downloadTo(std::span(population.ellipsoids), ellipsoids_.data(), stream_.get());
  downloadTo(std::span(population.states), states_.data(), stream_.get());
  return population;
}

FitErrors CudaPaperOptimiser::measure() {
  if (downloadValue(diverged_.data(), stream_.get()) != 0)
    throw RuntimeFailure("the fit diverged: an ellipsoid is not finite");
  FitErrors errors;
  pairCount_ = 0;
  for (auto& part : parts_) {
    rebuildLists(*part, kRoundingSlack);
    pairCount_ += part->lists.pairCount();
    if (part->bricks.size() == 0) continue;
    takeResiduals(*part);
    const std::span<const BrickMask> active(part->volume->active);
    uploadTo(active_.reserve(active.size()), active, stream_.get());
    errors.add(errorSums_.sum({.residual = residual_.data(),
                               .bricks = part->bricks.view().bricks,
                               .active = active_.data(),
                               .brickCount = std::uint32_t(part->bricks.size()),
                               .targetCount = std::uint32_t(part->bricks.targetCount()),
                               .box = target_.box}));
  }
  return errors;
}

std::size_t CudaPaperOptimiser::deviceBytes() const { return memory_.peak(); }

paper::LossGradients CudaPaperOptimiser::gradients(std::size_t subvolume) {
  Part& part = *parts_[subvolume];
  rebuildLists(part, paper::kListSlack);
  takeGradients(part);
  DeviceBuffer<paper::PaperVector> out(count_, stream_.get());
  launchPaperGradients(ellipsoids(), momentSums(part), out.data(), stream_.get());
  paper::LossGradients result{loss_.loss(), std::vector<paper::PaperVector>(count_)};
  out.download(result.byEllipsoid);
  return result;
}

}  // namespace cuda

std::unique_ptr<paper::PaperOptimiser> paper::makeCudaPaperOptimiser(const FitTarget& target,
                                                                     const PaperOptions& options) {
  cuda::useDevice(options.device);
  PaperOptions chosen = options;
  chosen.visitOnly = chosen.visitOnly || !cuda::fitsInMemory(target, options.maxDeviceBytes);
  return std::make_unique<cuda::CudaPaperOptimiser>(target, chosen);
}

}  // namespace esvr
