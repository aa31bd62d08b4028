// The optimiser of the paper's method on a GPU.

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/cuda/device_buffer.h"
#include "core/cuda/runtime.h"
#include "esvr/error.h"
#include "field/evaluate.h"
#include "fit/cuda/brick_pass.cuh"
#include "fit/cuda/lists.h"
#include "fit/cuda/make_cuda.h"
#include "fit/cuda/memory_plan.h"
#include "fit/cuda/step.h"
#include "fit/paper/cuda_paper_loss.h"

namespace esvr {
namespace cuda {
namespace {

// --- The passes over the bricks. One computes residuals; the other computes the moments of pairs
// from the derivative of a loss by every voxel.

/// All pointers are to device memory that the caller owns.
struct PaperPassArguments {
  PassScene scene;
  KernelConstants<float> kernel;          ///< kernel of all ellipsoids, if `kernels` is null
  const KernelConstants<float>* kernels;  ///< a kernel for each ellipsoid, or null
  PassTarget target;
  float* residual;           ///< output: kBrickVoxels values for each brick
  const float* lossByValue;  ///< input of the moments, in the layout of the residual
  float* moments;            ///< output: kMoments values for each pair
};

template <bool kOwnKernels>
__device__ auto kernelsOf(const PaperPassArguments& a) {
  if constexpr (kOwnKernels)
    return OwnKernels{a.kernels};
  else
    return SharedKernel{a.kernel};
}

/// Each block works on one brick, and each group of lanes on one pair at a time.
template <bool kOwnKernels, class Sum>
__global__ void __launch_bounds__(kBlock) residualPass(const PaperPassArguments a) {
  __shared__ Sum sums[kPaddedVoxels];
  const BlockBrick brick = blockBrick(a.scene);
  if (!isFor<Sum>(brick.entries)) return;
  sumBrick<Sum, kBlock>(a.scene, kernelsOf<kOwnKernels>(a), a.target, {nullptr, a.residual}, brick,
                        sums);
}

/// Loads the given derivatives into the memory in which the default fit's pass has its residuals.
__device__ void loadDerivatives(const PaperPassArguments& a, std::uint32_t brick,
                                NarrowSum* byValue) {
  for (int v = int(threadIdx.x); v < kBrickVoxels; v += kBlock)
    putValue(byValue[paddedOffset(v)], a.lossByValue[std::size_t(brick) * kBrickVoxels + v]);
}

template <bool kOwnKernels>
__global__ void __launch_bounds__(kBlock) momentPass(const PaperPassArguments a) {
  __shared__ NarrowSum byValue[kPaddedVoxels];
  const BlockBrick brick = blockBrick(a.scene);
  loadDerivatives(a, brick.number, byValue);
  __syncthreads();
  writeAllMoments<kBlock>(a.scene, kernelsOf<kOwnKernels>(a), brick, byValue, a.moments);
}

template <bool kOwnKernels>
void launchResidualPass(const PaperPassArguments& a, cudaStream_t stream) {
  if (const std::uint32_t wide = maxWideBricks(a.scene))
    residualPass<kOwnKernels, WideSum><<<wide, kBlock, 0, stream>>>(a);
  residualPass<kOwnKernels, NarrowSum><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
}

/// Writes the residuals.
void launchPaperResiduals(const PaperPassArguments& a, cudaStream_t stream) {
  if (a.scene.brickCount == 0) return;
  if (a.kernels != nullptr)
    launchResidualPass<true>(a, stream);
  else
    launchResidualPass<false>(a, stream);
  check(cudaGetLastError(), "starting the residuals of the paper's method");
}

/// Writes the moments for the given lossByValue.
void launchPaperMoments(const PaperPassArguments& a, cudaStream_t stream) {
  if (a.scene.brickCount == 0) return;
  if (a.kernels != nullptr)
    momentPass<true><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
  else
    momentPass<false><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting the moments of the paper's method");
}

// --- The step. One thread writes each ellipsoid.

/// Ellipsoids in the paper's parameters and in the forms that passes and lists use. All pointers
/// are to device memory that the caller owns.
struct PaperEllipsoids {
  std::uint32_t count;
  paper::KernelKind kind;
  Kernel kernel;                      ///< kernel of the scene
  KernelConstants<double> constants;  ///< constants of that kernel
  paper::PaperEllipsoid* ellipsoids;
  paper::PaperState* states;
  Ellipsoid* units;
  PairForm* forms;
  KernelConstants<float>* kernels;  ///< kernel of each ellipsoid if k is learned; else null
  double* radii;                    ///< radius of each support if k is learned; else null
  int* diverged;                    ///< is set to 1 if an ellipsoid is not finite
};

constexpr int kStepBlock = 64;  // small blocks spread few ellipsoids over many multiprocessors

__device__ std::uint32_t ownEllipsoid() { return blockIdx.x * kStepBlock + threadIdx.x; }

/// Converts an ellipsoid from the paper's parameters to the forms that passes and lists use.
__device__ void writeForms(const PaperEllipsoids& a, std::uint32_t i,
                           const paper::PaperEllipsoid& p) {
  const Ellipsoid unit = ellipsoidOf(p, a.kind);
  double radius = supportRadius(a.constants);
  if (a.kernels != nullptr) {
    const auto constants = kernelConstants<double>(a.kernel, p.k);
    radius = supportRadius(constants);
    a.kernels[i] = narrowed(constants);
    a.radii[i] = radius;
  }
  a.units[i] = unit;
  a.forms[i] = pairForm(unit, radius);
  if (!finite(unit)) *a.diverged = 1;
}

__device__ paper::PaperVector gradientOf(const PaperEllipsoids& a, const MomentSums& s,
                                         std::uint32_t i, const paper::PaperEllipsoid& p) {
  const PairSums sums = sumsOf(s, i);
  const double slope = a.kernels != nullptr ? double(a.kernels[i].slope) : a.constants.slope;
  return byPaperParameters(p, a.units[i], ellipsoidGradient(a.forms[i].form, sums, slope));
}

__global__ void __launch_bounds__(kStepBlock) formsKernel(const PaperEllipsoids a) {
  const std::uint32_t i = ownEllipsoid();
  if (i < a.count) writeForms(a, i, a.ellipsoids[i]);
}

__global__ void __launch_bounds__(kStepBlock)
    stepKernel(const PaperEllipsoids a, const MomentSums s, const paper::PaperStep step) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.count) return;
  paper::PaperEllipsoid p = a.ellipsoids[i];
  paper::PaperState state = a.states[i];
  const bool reached = s.lists.ellipsoidBegin[i + 1] > s.lists.ellipsoidBegin[i];
  takeStep(p, state, gradientOf(a, s, i, p), reached, step);
  a.ellipsoids[i] = p;
  a.states[i] = state;
  writeForms(a, i, p);
}

__global__ void __launch_bounds__(kStepBlock)
    gradientsKernel(const PaperEllipsoids a, const MomentSums s, paper::PaperVector* out) {
  const std::uint32_t i = ownEllipsoid();
  if (i < a.count) out[i] = gradientOf(a, s, i, a.ellipsoids[i]);
}

/// Writes units, forms, kernels and radii.
void launchPaperForms(const PaperEllipsoids& a, cudaStream_t stream) {
  if (a.count == 0) return;
  formsKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to prepare ellipsoids");
}

/// Takes the step. launchMomentSums must have been called before.
void launchPaperStep(const PaperEllipsoids& a, const MomentSums& sums, const paper::PaperStep& step,
                     cudaStream_t stream) {
  if (a.count == 0) return;
  stepKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a, sums, step);
  check(cudaGetLastError(), "starting a step");
}

/// Writes the gradients by the paper's parameters. launchMomentSums must have been called before.
void launchPaperGradients(const PaperEllipsoids& a, const MomentSums& sums, paper::PaperVector* out,
                          cudaStream_t stream) {
  if (a.count == 0) return;
  gradientsKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a, sums, out);
  check(cudaGetLastError(), "starting to read gradients");
}

// --- The optimiser.

class CudaPaperOptimiser final : public paper::PaperOptimiser {
 public:
  /// The device of the options must be the current one.
  CudaPaperOptimiser(const FitTarget& target, const paper::PaperOptions& options);

  [[nodiscard]] std::size_t subvolumeCount() const override { return parts_.size(); }
  void iterate(std::size_t subvolume, const paper::PaperStep& step) override;
  [[nodiscard]] paper::LossGradients gradients(std::size_t subvolume) override;
  void put(const paper::Population& population) override;
  [[nodiscard]] paper::Population population() const override;
  [[nodiscard]] std::size_t ellipsoidCount() const override { return count_; }
  [[nodiscard]] FitErrors measure() override;
  [[nodiscard]] std::uint64_t pairCount() const override { return pairCount_; }
  [[nodiscard]] std::size_t deviceBytes() const override;

 private:
  /// A subvolume and its data on the device.
  struct Part {
    Part(std::unique_ptr<paper::Subvolume> from, bool visitOnly, cudaStream_t stream);

    std::unique_ptr<paper::Subvolume> volume;
    DeviceBuffer<float> values;  ///< values of the target; empty if they are uploaded on each visit
    BrickTable bricks, windows;
    PairLists lists;
    double motionLeft = -1.0;  ///< voxels by which supports may still move; < 0: lists are outdated
  };

  void requireMemoryFor(std::size_t ellipsoids) const;
  void rebuildLists(Part& part, double slack);
  void bring(const Part& part);
  void takeGradients(Part& part);
  void takeResiduals(Part& part);
  [[nodiscard]] PaperEllipsoids ellipsoids();
  [[nodiscard]] PaperPassArguments passArguments(const Part& part);
  [[nodiscard]] MomentSums momentSums(const Part& part);

  const FitTarget& target_;
  paper::PaperOptions options_;
  Kernel kernel_;
  KernelConstants<double> constants_;
  MemoryShare memory_;  ///< what the buffers below take
  KeepFreedMemory keep_;
  Stream stream_;
  std::vector<std::unique_ptr<Part>> parts_;
  GrowingBuffer<paper::PaperEllipsoid> ellipsoids_;
  GrowingBuffer<paper::PaperState> states_;
  GrowingBuffer<Ellipsoid> units_;
  GrowingBuffer<PairForm> forms_;
  GrowingBuffer<KernelConstants<float>> kernels_;
  GrowingBuffer<double> radii_;
  GrowingBuffer<float> moments_, residual_, visited_;
  GrowingBuffer<BrickMask> active_;
  const float* values_ = nullptr;  ///< target's values of the visited subvolume
  GrowingBuffer<double> chunkSums_;
  DeviceBuffer<int> diverged_;
  ErrorSums errorSums_;
  PaperLoss loss_;
  std::size_t count_ = 0;
  std::uint64_t pairCount_ = 0;
};

double windowBytes(const FitTarget& target) {
  constexpr double kWithReached = 2.0;  // estimate: as many reached bricks as target bricks
  return PaperLoss::bytesFor(kWithReached * double(target.bricks.size()));
}

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

}  // namespace
}  // namespace cuda

std::unique_ptr<paper::PaperOptimiser> makeCudaPaperOptimiser(const FitTarget& target,
                                                              const paper::PaperOptions& options) {
  cuda::useDevice(options.device);
  paper::PaperOptions chosen = options;
  chosen.visitOnly = chosen.visitOnly || !cuda::fitsInMemory(target, options.maxDeviceBytes);
  return std::make_unique<cuda::CudaPaperOptimiser>(target, chosen);
}

}  // namespace esvr
