#include "core/cuda/check.h"
#include "core/cuda/launch.h"
#include "fit/cuda/moment_sums.cuh"
#include "fit/paper/cuda/paper_step.h"
#include "fit/scene.h"

namespace esvr::cuda {
namespace {

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

}  // namespace

void launchPaperForms(const PaperEllipsoids& a, cudaStream_t stream) {
  if (a.count == 0) return;
  formsKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting to prepare ellipsoids");
}

void launchPaperStep(const PaperEllipsoids& a, const MomentSums& sums, const paper::PaperStep& step,
                     cudaStream_t stream) {
  if (a.count == 0) return;
  stepKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a, sums, step);
  check(cudaGetLastError(), "starting a step");
}

void launchPaperGradients(const PaperEllipsoids& a, const MomentSums& sums, paper::PaperVector* out,
                          cudaStream_t stream) {
  if (a.count == 0) return;
  gradientsKernel<<<blocksFor(a.count, kStepBlock), kStepBlock, 0, stream>>>(a, sums, out);
  check(cudaGetLastError(), "starting to read gradients");
}

}  // namespace esvr::cuda
