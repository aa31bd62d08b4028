#include "core/cuda/runtime.h"
#include "fit/cuda/cuda_optimiser.h"
#include "stability.h"

namespace esvr::bench {

std::vector<EllipsoidGradient> gradientsOnGpu(const FitTarget& target, const Kernel& kernel,
                                              std::span<const Ellipsoid> ellipsoids,
                                              const Device& device) {
  cuda::useDevice(device);
  OptimiserOptions options;
  options.kernel = kernel;
  options.device = device;
  cuda::CudaOptimiser optimiser(target, options, {});
  optimiser.setEllipsoids(ellipsoids);
  return optimiser.gradients();
}

}  // namespace esvr::bench
