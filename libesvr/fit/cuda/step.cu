#include "fit/cuda/step.h"

#include "core/cuda/check.h"
#include "core/cuda/reduce.cuh"
#include "fit/adam_math.h"
#include "fit/cuda/halt.h"
#include "fit/cuda/moment_sums.cuh"
#include "fit/motion_bound.h"
#include "fit/parameter_gradient.h"

namespace esvr::cuda {
namespace {

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

}  // namespace

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

}  // namespace esvr::cuda
