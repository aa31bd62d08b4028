#include "core/cuda/check.h"
#include "fit/adam_math.h"
#include "fit/cuda/launch.h"
#include "fit/cuda/pair_sums.cuh"
#include "fit/cuda/step.h"
#include "fit/parameter_gradient.h"

namespace esvr::cuda {
namespace {

constexpr int kLanes = 16;      // of a chunk: one a moment, and some to spare
constexpr int kStepBlock = 64;  // small: few ellipsoids are to use many processors
constexpr int kLossBlock = 1024;
static_assert(kLanes >= kMoments);

/// One lane a moment: the pairs of a chunk lie side by side.
__global__ void sumChunks(const StepArguments a) {
  const std::uint32_t thread = blockIdx.x * kBlock + threadIdx.x;
  const std::uint32_t chunk = thread / kLanes, lane = thread % kLanes;
  if (chunk >= a.chunkCount || lane >= kMoments) return;
  const std::uint32_t i = a.lists.chunkOwner[chunk];
  const std::uint32_t begin =
      a.lists.ellipsoidBegin[i] + (chunk - a.lists.chunkBegin[i]) * PairListsView::kChunk;
  const std::uint32_t end = min(a.lists.ellipsoidBegin[i + 1], begin + PairListsView::kChunk);
  double sum = 0.0;
#pragma unroll 4
  for (std::uint32_t k = begin; k < end; ++k)
    sum += double(a.moments[std::size_t(k) * kMoments + lane]);
  a.chunkSums[std::size_t(chunk) * kMoments + lane] = sum;
}

/// Sum of value(0 .. count - 1) in one order, by one block.
template <class Value>
__device__ void sumByOneBlock(std::uint32_t count, const Value& value, double* out) {
  __shared__ double parts[kLossBlock];
  double sum = 0.0;
  for (std::uint32_t k = threadIdx.x; k < count; k += kLossBlock) sum += value(k);
  parts[threadIdx.x] = sum;
  for (int half = kLossBlock / 2; half > 0; half /= 2) {
    __syncthreads();
    if (threadIdx.x < half) parts[threadIdx.x] += parts[threadIdx.x + half];
  }
  if (threadIdx.x == 0) *out = parts[0];
}

__global__ void __launch_bounds__(kLossBlock) sumLoss(const StepArguments a) {
  sumByOneBlock(
      a.brickCount, [&](std::uint32_t b) { return a.brickLoss[b]; }, a.loss);
}

__global__ void __launch_bounds__(kLossBlock)
    sumEdges(const Usefulness* usefulness, std::uint32_t count, double* out) {
  sumByOneBlock(
      count, [&](std::uint32_t i) { return double(usefulness[i].edge); }, out);
}

__device__ std::uint32_t ownEllipsoid() { return blockIdx.x * kStepBlock + threadIdx.x; }

__device__ Usefulness usefulnessOf(const StepArguments& a, const PairSums& sums,
                                   const EllipsoidGradient& gradient) {
  return {float(sums.phi2), float(sums.rPhi), float(edgeGradient(gradient, a.edge.logMByKappa))};
}

__global__ void __launch_bounds__(kStepBlock) step(const StepArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.ellipsoidCount) return;

  const PairSums sums = sumsOf(a, i);
  Ellipsoid p = a.ellipsoids[i];
  AdamState adam = a.states[i];
  const EllipsoidGradient gradient = ellipsoidGradient(a.forms[i].form, sums, a.edge.slope);
  const ParameterVector largest = largestStep(p, a.sizes.scaled(a.factor));
  moveWithin(p, adamDirection(adam, gradient.byParameter, a.adam, largest), a.limits);
  a.ellipsoids[i] = p;
  a.states[i] = adam;
  a.forms[i] = pairForm(p, a.radius);
  a.usefulness[i] = usefulnessOf(a, sums, gradient);
  if (!finite(p)) *a.diverged = 1;  // integer sums would hide it
}

__global__ void __launch_bounds__(kStepBlock) writeUsefulness(const StepArguments a) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.ellipsoidCount) return;
  const PairSums sums = sumsOf(a, i);
  a.usefulness[i] = usefulnessOf(a, sums, ellipsoidGradient(a.forms[i].form, sums, a.edge.slope));
}

__global__ void __launch_bounds__(kStepBlock)
    readGradients(const StepArguments a, EllipsoidGradient* out) {
  const std::uint32_t i = ownEllipsoid();
  if (i >= a.ellipsoidCount) return;
  out[i] = ellipsoidGradient(a.forms[i].form, sumsOf(a, i), a.edge.slope);
}

__global__ void __launch_bounds__(kStepBlock)
    writeForms(const Ellipsoid* ellipsoids, std::uint32_t count, double radius, PairForm* forms) {
  const std::uint32_t i = ownEllipsoid();
  if (i < count) forms[i] = pairForm(ellipsoids[i], radius);
}

__global__ void __launch_bounds__(kStepBlock)
    shrink(Ellipsoid* ellipsoids, std::uint32_t count, double factor) {
  const std::uint32_t i = ownEllipsoid();
  if (i < count) shrinkBy(ellipsoids[i], factor);
}

}  // namespace

void launchSums(const StepArguments& a, cudaStream_t stream) {
  if (a.chunkCount > 0)
    sumChunks<<<blocksFor(std::size_t(a.chunkCount) * kLanes, kBlock), kBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting the sums of moments");
  sumLoss<<<1, kLossBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting the sum of the loss");
}

void launchStep(const StepArguments& a, cudaStream_t stream) {
  if (a.ellipsoidCount == 0) return;
  step<<<blocksFor(a.ellipsoidCount, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting a step");
}

void launchUsefulness(const StepArguments& a, cudaStream_t stream) {
  if (a.ellipsoidCount == 0) return;
  writeUsefulness<<<blocksFor(a.ellipsoidCount, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to weigh ellipsoids");
}

void launchReadGradients(const StepArguments& a, EllipsoidGradient* out, cudaStream_t stream) {
  if (a.ellipsoidCount == 0) return;
  readGradients<<<blocksFor(a.ellipsoidCount, kStepBlock), kStepBlock, 0, stream>>>(a, out);
  check(cudaGetLastError(), "starting to read gradients");
}

void launchEdgeSum(const Usefulness* usefulness, std::uint32_t count, double* sum,
                   cudaStream_t stream) {
  sumEdges<<<1, kLossBlock, 0, stream>>>(usefulness, count, sum);
  check(cudaGetLastError(), "starting the sum of slopes by kappa");
}

void launchShrink(Ellipsoid* ellipsoids, std::uint32_t count, double factor, cudaStream_t stream) {
  if (count == 0) return;
  shrink<<<blocksFor(count, kStepBlock), kStepBlock, 0, stream>>>(ellipsoids, count, factor);
  check(cudaGetLastError(), "starting to shrink ellipsoids");
}

void launchForms(const Ellipsoid* ellipsoids, std::uint32_t count, double radius, PairForm* forms,
                 cudaStream_t stream) {
  if (count == 0) return;
  writeForms<<<blocksFor(count, kStepBlock), kStepBlock, 0, stream>>>(ellipsoids, count, radius,
                                                                      forms);
  check(cudaGetLastError(), "starting to prepare ellipsoids");
}

}  // namespace esvr::cuda
