#pragma once
/// Makes the optimiser on a GPU. This header does not include those of CUDA.

#include <memory>

#include "fit/optimiser.h"

namespace esvr {

/// \throws DeviceError  the device does not exist, the build has no CUDA, or device memory is
///                      exhausted; the message says which
[[nodiscard]] std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                                           const OptimiserOptions& options,
                                                           const Tuning& tuning);

}  // namespace esvr
