#include "fit/cuda/make_cuda_optimiser.h"

#include "core/cuda/memory_pool.h"
#include "core/cuda/use_device.h"
#include "fit/cuda/cuda_optimiser.h"
#include "fit/cuda/memory_plan.h"

namespace esvr {

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                             const OptimiserOptions& options,
                                             const Tuning& tuning) {
  cuda::useDevice(options.device);
  cuda::requireMemory(target, 1, options.maxDeviceBytes);
  return std::make_unique<cuda::CudaOptimiser>(target, options, tuning);
}

std::shared_ptr<void> keepFreedMemory(const Device& device) {
  cuda::useDevice(device);
  return std::make_shared<cuda::KeepFreedMemory>();
}

bool fitsOnGpu(const FitSize& size, std::size_t ellipsoids, const Device& device,
               std::optional<std::size_t> maxBytes) {
  cuda::useDevice(device);
  return cuda::fitsInMemory(size, ellipsoids, maxBytes);
}

}  // namespace esvr
