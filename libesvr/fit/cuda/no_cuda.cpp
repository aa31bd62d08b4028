#include <string>

#include "core/cuda_probe.h"
#include "esvr/error.h"
#include "fit/cuda/make_cuda_optimiser.h"

namespace esvr {

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget&, const OptimiserOptions& options,
                                             const Tuning&) {
  throw DeviceError("fitting on cuda:" + std::to_string(options.device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace esvr
