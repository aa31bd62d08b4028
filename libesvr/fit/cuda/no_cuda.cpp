#include "core/device_choice.h"
#include "fit/cuda/make_cuda.h"

namespace esvr {

std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget&, const OptimiserOptions& options,
                                             const Tuning&) {
  refuseCuda("fitting", options.device);
}

std::shared_ptr<void> keepFreedMemory(const Device& device) { refuseCuda("fitting", device); }

bool fitsOnGpu(const FitSize&, std::size_t, const Device& device, std::optional<std::size_t>) {
  refuseCuda("fitting", device);
}

std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(const IntensityTarget&,
                                                         const Device& device) {
  refuseCuda("fitting", device);
}

std::unique_ptr<paper::PaperOptimiser> makeCudaPaperOptimiser(const FitTarget&,
                                                              const paper::PaperOptions& options) {
  refuseCuda("fitting", options.device);
}

}  // namespace esvr
