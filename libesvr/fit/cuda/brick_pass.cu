// This file is compiled with approximate functions (CMakeLists.txt).

#include "core/cuda/runtime.h"
#include "fit/cuda/brick_pass.cuh"

namespace esvr::cuda {
namespace {

enum class Pass { kGradients, kResiduals };

/// Each block works on one brick, and each group of lanes on one pair at a time.
template <Pass kPass, class Sum, int kThreads>
__global__ void __launch_bounds__(kThreads) brickPass(const BrickPassArguments a) {
  __shared__ Sum sums[kPaddedVoxels];
  const BlockBrick brick = blockBrick(a.scene);
  if (isHalted(a.halted) || !isFor<Sum>(brick.entries)) return;
  const SharedKernel kernels{a.kernel};
  sumBrick<Sum, kThreads>(a.scene, kernels, a.target, {a.brickLoss, a.residual}, brick, sums);
  if constexpr (kPass == Pass::kResiduals) return;
  __syncthreads();
  writeAllMoments<kThreads>(a.scene, kernels, brick, sums, a.moments);
}

template <Pass kPass, int kChoice>
void launch(const BrickPassArguments& a, cudaStream_t stream) {
  constexpr int kThreads = ThreadsPerBrick::threads(kChoice);
  if (a.scene.brickCount == 0) return;
  if (const std::uint32_t wide = maxWideBricks(a.scene))
    brickPass<kPass, WideSum, kThreads><<<wide, kThreads, 0, stream>>>(a);
  brickPass<kPass, NarrowSum, kThreads><<<a.scene.brickCount, kThreads, 0, stream>>>(a);
  check(cudaGetLastError(), "starting a pass over the bricks");
}

}  // namespace

void launchGradients(const BrickPassArguments& arguments, int threads, cudaStream_t stream) {
  static_assert(ThreadsPerBrick::kChoices == 3);
  if (threads == ThreadsPerBrick::threads(0))
    launch<Pass::kGradients, 0>(arguments, stream);
  else if (threads == ThreadsPerBrick::threads(1))
    launch<Pass::kGradients, 1>(arguments, stream);
  else
    launch<Pass::kGradients, 2>(arguments, stream);
}

void launchResiduals(const BrickPassArguments& arguments, cudaStream_t stream) {
  launch<Pass::kResiduals, 1>(arguments, stream);
}

}  // namespace esvr::cuda
