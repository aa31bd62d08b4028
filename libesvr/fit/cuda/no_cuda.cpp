#include <string>

#include "core/cuda_probe.h"
#include "esvr/error.h"
#include "fit/cuda/make_cuda_intensity_passes.h"
#include "fit/cuda/make_cuda_optimiser.h"
#include "fit/cuda/make_cuda_paper_optimiser.h"

namespace esvr {
namespace {

[[noreturn]] void refuse(const Device& device) {
  throw DeviceError("fitting on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget&, const OptimiserOptions& options,
                                             const Tuning&) {
  refuse(options.device);
}

std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(const IntensityTarget&,
                                                         const Device& device) {
  refuse(device);
}

namespace paper {
std::unique_ptr<PaperOptimiser> makeCudaPaperOptimiser(const FitTarget&,
                                                       const PaperOptions& options) {
  refuse(options.device);
}
}  // namespace paper

}  // namespace esvr
