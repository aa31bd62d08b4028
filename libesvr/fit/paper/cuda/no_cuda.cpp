#include "core/refuse_cuda.h"
#include "fit/paper/cuda/make_cuda_paper_optimiser.h"

namespace esvr::paper {

std::unique_ptr<PaperOptimiser> makeCudaPaperOptimiser(const FitTarget&,
                                                       const PaperOptions& options) {
  refuseCuda("fitting", options.device);
}

}  // namespace esvr::paper
