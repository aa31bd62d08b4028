#include "field/cuda/evaluate_launch.h"

#include "core/cuda/check.h"
#include "field/cuda/evaluate_kernel.cuh"

namespace esvr::cuda {

void launchEvaluate(const EvaluateArguments& arguments, cudaStream_t stream) {
  if (arguments.bricks == 0) return;
  const auto kernel =
      arguments.ownKernels != nullptr ? evaluateBricksKernel<true> : evaluateBricksKernel<false>;
  kernel<<<arguments.bricks, EvaluateTuning::kThreads, 0, stream>>>(arguments);
  check(cudaGetLastError(), "starting the evaluation of bricks");
}

}  // namespace esvr::cuda
