#pragma once
/// The optimiser on a GPU, free of CUDA's own headers.

#include <memory>

#include "fit/optimiser.h"

namespace esvr {

/// \throws DeviceError  no such device, a build without CUDA, out of device memory; says which
[[nodiscard]] std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                                           const OptimiserOptions& options,
                                                           const Tuning& tuning);

}  // namespace esvr
