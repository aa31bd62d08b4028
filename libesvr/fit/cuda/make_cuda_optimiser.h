#pragma once
/// Makes the optimiser on a GPU. This header does not include those of CUDA.

#include <cstddef>
#include <memory>
#include <optional>

#include "fit/fit_size.h"
#include "fit/optimiser.h"

namespace esvr {

/// \throws DeviceError  the device does not exist, the build has no CUDA, or device memory is
///                      exhausted; the message says which
[[nodiscard]] std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                                           const OptimiserOptions& options,
                                                           const Tuning& tuning);

/// While the result lives, memory that is freed on a GPU stays with the process, so that the next
/// optimiser gets it quickly.
/// \throws DeviceError  the device does not exist, or the build has no CUDA
[[nodiscard]] std::shared_ptr<void> keepFreedMemory(const Device& device);

/// True if a fit with this number of ellipsoids, at least 1, stays within `maxBytes`, or else within
/// the free memory of the device.
/// \throws DeviceError  the device does not exist, or the build has no CUDA
[[nodiscard]] bool fitsOnGpu(const FitSize& size, std::size_t ellipsoids, const Device& device,
                             std::optional<std::size_t> maxBytes);

}  // namespace esvr
