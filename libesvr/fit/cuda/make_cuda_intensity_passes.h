#pragma once
/// Makes IntensityPasses on a GPU. The function exists in every build; without CUDA it throws.

#include <memory>

#include "fit/intensity_passes.h"

namespace esvr {

/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(
    const IntensityTarget& target, const Device& device);

}  // namespace esvr
