#pragma once
/// The paper's method on a GPU, free of CUDA's own headers.

#include <memory>

#include "fit/paper/paper_optimiser.h"

namespace esvr::paper {

/// \throws DeviceError  no such device, a build without CUDA, out of device memory; says which
[[nodiscard]] std::unique_ptr<PaperOptimiser> makeCudaPaperOptimiser(const FitTarget& target,
                                                                     const PaperOptions& options);

}  // namespace esvr::paper
