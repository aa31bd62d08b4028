#pragma once
/// What the fits need of a GPU. The functions exist in every build; without CUDA they throw. This
/// header does not include those of CUDA.

#include <cstddef>
#include <memory>
#include <optional>

#include "fit/intensity_problem.h"
#include "fit/optimiser.h"
#include "fit/paper/paper_optimiser.h"

namespace esvr {

/// \throws DeviceError  the device does not exist, the build has no CUDA, or device memory is
///                      exhausted; the message says which
[[nodiscard]] std::unique_ptr<Optimiser> makeCudaOptimiser(const FitTarget& target,
                                                           const OptimiserOptions& options,
                                                           const Tuning& tuning);
[[nodiscard]] std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(
    const IntensityTarget& target, const Device& device);
[[nodiscard]] std::unique_ptr<paper::PaperOptimiser> makeCudaPaperOptimiser(
    const FitTarget& target, const paper::PaperOptions& options);

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
