#include "fit/cpu/cpu_optimiser.h"
#include "fit/cuda/make_cuda_optimiser.h"
#include "fit/optimiser.h"

namespace esvr {

std::unique_ptr<Optimiser> makeOptimiser(const FitTarget& target, const OptimiserOptions& options,
                                         const Tuning& tuning) {
  if (options.device.kind == DeviceKind::kCuda) return makeCudaOptimiser(target, options, tuning);
  return std::make_unique<CpuOptimiser>(target, options, tuning);
}

}  // namespace esvr
