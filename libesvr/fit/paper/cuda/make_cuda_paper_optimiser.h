#pragma once
/// Makes the optimiser of the paper's method on a GPU. This header does not include those of CUDA.

#include <memory>

#include "fit/paper/paper_optimiser.h"

namespace esvr::paper {

/// \throws DeviceError  the device does not exist, the build has no CUDA, or device memory is
///                      exhausted; the message says which
[[nodiscard]] std::unique_ptr<PaperOptimiser> makeCudaPaperOptimiser(const FitTarget& target,
                                                                     const PaperOptions& options);

}  // namespace esvr::paper
