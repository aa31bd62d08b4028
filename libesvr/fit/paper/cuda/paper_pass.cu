#include "fit/paper/cuda/paper_pass.h"

#include "core/cuda/check.h"
#include "fit/cuda/brick_pass.cuh"

namespace esvr::cuda {
namespace {

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

}  // namespace

void launchPaperResiduals(const PaperPassArguments& a, cudaStream_t stream) {
  if (a.scene.brickCount == 0) return;
  if (a.kernels != nullptr)
    launchResidualPass<true>(a, stream);
  else
    launchResidualPass<false>(a, stream);
  check(cudaGetLastError(), "starting the residuals of the paper's method");
}

void launchPaperMoments(const PaperPassArguments& a, cudaStream_t stream) {
  if (a.scene.brickCount == 0) return;
  if (a.kernels != nullptr)
    momentPass<true><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
  else
    momentPass<false><<<a.scene.brickCount, kBlock, 0, stream>>>(a);
  check(cudaGetLastError(), "starting the moments of the paper's method");
}

}  // namespace esvr::cuda
