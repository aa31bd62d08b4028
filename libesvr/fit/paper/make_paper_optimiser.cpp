#include "fit/paper/cpu_paper_optimiser.h"
#include "fit/paper/cuda/make_cuda_paper_optimiser.h"

namespace esvr::paper {

std::unique_ptr<PaperOptimiser> makePaperOptimiser(const FitTarget& target,
                                                   const PaperOptions& options) {
  if (options.device.kind == DeviceKind::kCuda) return makeCudaPaperOptimiser(target, options);
  return std::make_unique<CpuPaperOptimiser>(target, options);
}

}  // namespace esvr::paper
