#include "fit/cuda/step.h"

#include <array>
#include <cub/device/device_reduce.cuh>

#include "core/cuda/device_buffer.h"
#include "core/cuda/reduce.cuh"
#include "core/cuda/runtime.h"

namespace esvr::cuda {
namespace {

constexpr int kLanes = 16;  // lanes of a chunk: kMoments, rounded up to a power of two
static_assert(kLanes >= kMoments);

/// Each lane sums one moment over the pairs of a chunk, which lie next to each other in memory.
__global__ void sumChunks(const MomentSums a) {
  const std::size_t thread = threadNumber();
  const std::size_t chunk = thread / kLanes, lane = thread % kLanes;
  if (chunk >= a.chunkCount || lane >= kMoments || isHalted(a.halted)) return;
  const std::uint32_t i = a.lists.chunkOwner[chunk];
  const std::uint32_t begin = a.lists.ellipsoidBegin[i] +
                              std::uint32_t(chunk - a.lists.chunkBegin[i]) * PairListsView::kChunk;
  const std::uint32_t end = min(a.lists.ellipsoidBegin[i + 1], begin + PairListsView::kChunk);
  double sum = 0.0;
#pragma unroll 4
  for (std::uint32_t k = begin; k < end; ++k)
    sum += double(a.moments[std::size_t(k) * kMoments + lane]);
  a.chunkSums[chunk * kMoments + lane] = sum;
}

constexpr int kStepBlock = 64;  // small blocks spread few ellipsoids over many multiprocessors
constexpr int kSumBlock = 1024;

/// Sums value(0) to value(count - 1) with one block.
template <class Value>
__device__ void sumByOneBlock(std::uint32_t count, const Value& value, double* out) {
  double sum = 0.0;
  for (std::uint32_t k = threadIdx.x; k < count; k += kSumBlock) sum += value(k);
  sum = blockSum<kSumBlock>(sum);
  if (threadIdx.x == 0) *out = sum;
}

__global__ void __launch_bounds__(kSumBlock)
    sumLoss(const double* brickLoss, std::uint32_t count, double* out) {
  sumByOneBlock(
      count, [&](std::uint32_t b) { return brickLoss[b]; }, out);
}

__global__ void __launch_bounds__(kSumBlock)
    sumEdges(const Usefulness* usefulness, std::uint32_t count, double* out) {
  sumByOneBlock(
      count, [&](std::uint32_t i) { return double(usefulness[i].edge); }, out);
}

__device__ std::uint32_t ownEllipsoid() { return blockIdx.x * kStepBlock + threadIdx.x; }

__global__ void __launch_bounds__(kStepBlock) step(const StepArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (isHalted(a.halted)) {
    if (i == 0) *a.halts = 1;
    return;
  }
  if (i >= a.ellipsoidCount) return;

  const PairSums sums = sumsOf(a.sums, i);
  const Ellipsoid before = a.ellipsoids[i];
  Ellipsoid p = before;
  AdamState adam = a.states[i];
  const EllipsoidGradient gradient = ellipsoidGradient(a.forms[i].form, sums, a.edge.slope);
  const ParameterVector largest = largestStep(p, a.sizes.scaled(a.factor));
  moveWithin(p, adamDirection(adam, gradient.byParameter, a.adam, largest), a.limits);
  if (!finite(p)) *a.diverged = 1;  // integer sums would hide it
  if (refuseStep(a.listed[i], a.core, before, p) && atomicAdd(a.refused, 1u) + 1 == a.maxRefused)
    *a.halts = 1;
  a.ellipsoids[i] = p;
  a.states[i] = adam;
  a.forms[i] = pairForm(p, a.radius);
  a.usefulness[i] = {float(sums.phi2), float(sums.rPhi),
                     float(edgeGradient(gradient, a.edge.logMByKappa))};
}

__global__ void __launch_bounds__(kStepBlock) list(const ListingArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (i < a.count)
    a.listed[i] = listedSupport(a.ellipsoids[i], a.states[i].steps, a.listed[i], a.radius, a.rule);
}

__global__ void __launch_bounds__(kStepBlock)
    readGradients(const StepArguments a, EllipsoidGradient* out) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.ellipsoidCount) return;
  out[i] = ellipsoidGradient(a.forms[i].form, sumsOf(a.sums, i), a.edge.slope);
}

__global__ void __launch_bounds__(kStepBlock) writeForms(const FormArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (i < a.count) a.forms[i] = pairForm(a.ellipsoids[i], a.radius);
}

__global__ void __launch_bounds__(kStepBlock) shrink(const ShrinkArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.count) return;
  shrinkBy(a.ellipsoids[i], a.factor);
  if (a.listed != nullptr && !isHeld(a.listed[i], a.ellipsoids[i], a.core)) *a.halts = 1;
}

constexpr int kColumns = 4;  // members of FitErrors, in its order

/// Each warp sums one brick. Column c of brick b is written to out[c * brickCount + b].
__global__ void brickErrors(const ErrorArguments a, double* out) {
  const std::size_t b = warpNumber();
  if (b >= a.brickCount) return;
  const Coord corner = a.bricks[b] * kBrickSide;
  double all = 0.0, box = 0.0, active = 0.0, largest = 0.0;
  for (int v = int(threadIdx.x % kWarp); v < kBrickVoxels; v += kWarp) {
    const double r = double(a.residual[b * kBrickVoxels + v]);
    all += r * r;
    if (a.box.contains(corner + voxelLocal(v))) box += r * r;
    if (b < a.targetCount && a.active[b].test(v)) active += r * r;
    largest = fmax(largest, fabs(r));
  }
  all = warpSum(all), box = warpSum(box), active = warpSum(active), largest = warpMax(largest);
  if (threadIdx.x % kWarp != 0) return;
  const std::size_t n = a.brickCount;
  out[b] = all, out[n + b] = box, out[2 * n + b] = active, out[3 * n + b] = largest;
}

}  // namespace

void launchMomentSums(const MomentSums& sums, cudaStream_t stream) {
  if (sums.chunkCount == 0) return;
  sumChunks<<<blocksFor(std::size_t(sums.chunkCount) * kLanes, kBlock), kBlock, 0, stream>>>(sums);
  check(cudaGetLastError(), "starting the sums of moments");
}

void launchStep(const StepArguments& a, cudaStream_t stream) {
  if (a.ellipsoidCount == 0) return;
  step<<<blocksFor(a.ellipsoidCount, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting a step");
}

void launchReadGradients(const StepArguments& a, EllipsoidGradient* out, cudaStream_t stream) {
  if (a.ellipsoidCount == 0) return;
  readGradients<<<blocksFor(a.ellipsoidCount, kStepBlock), kStepBlock, 0, stream>>>(a, out);
  check(cudaGetLastError(), "starting to read gradients");
}

void launchLossSum(const double* brickLoss, std::uint32_t bricks, double* sum,
                   cudaStream_t stream) {
  sumLoss<<<1, kSumBlock, 0, stream>>>(brickLoss, bricks, sum);
  check(cudaGetLastError(), "starting the sum of the loss");
}

void launchListing(const ListingArguments& a, cudaStream_t stream) {
  if (a.count == 0) return;
  list<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to list supports");
}

void launchEdgeSum(const Usefulness* usefulness, std::uint32_t count, double* sum,
                   cudaStream_t stream) {
  sumEdges<<<1, kSumBlock, 0, stream>>>(usefulness, count, sum);
  check(cudaGetLastError(), "starting the sum of slopes by kappa");
}

void launchShrink(const ShrinkArguments& a, cudaStream_t stream) {
  if (a.count == 0) return;
  shrink<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to shrink ellipsoids");
}

void launchForms(const FormArguments& a, cudaStream_t stream) {
  if (a.count == 0) return;
  writeForms<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to prepare ellipsoids");
}

ErrorSums::ErrorSums(cudaStream_t stream)
    : stream_(stream), columns_(stream), totals_(stream), temporary_(stream) {}

FitErrors ErrorSums::sum(const ErrorArguments& a) {
  const std::size_t n = a.brickCount;
  double* const columns = columns_.reserve(kColumns * n);
  double* const totals = totals_.reserve(kColumns);
  brickErrors<<<blocksFor(n * kWarp, kBlock), kBlock, 0, stream_>>>(a, columns);
  check(cudaGetLastError(), "summing errors");
  // On one kind of device, CUB reduces doubles in the same order in every run.
  for (int c = 0; c < kColumns; ++c)
    withTemporary(temporary_, "summing errors", [&](void* memory, std::size_t& bytes) {
      if (c == kColumns - 1)
        return cub::DeviceReduce::Max(memory, bytes, columns + c * n, totals + c, n, stream_);
      return cub::DeviceReduce::Sum(memory, bytes, columns + c * n, totals + c, n, stream_);
    });
  std::array<double, kColumns> values{};
  downloadTo(std::span<double>(values), totals, stream_);
  return {values[0], values[1], values[2], values[3]};
}

}  // namespace esvr::cuda
