#pragma once
/// IntensityPasses on a GPU, in every build; without CUDA there are none and it throws.

#include <memory>

#include "fit/intensity_passes.h"

namespace esvr {

/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::unique_ptr<IntensityPasses> makeCudaIntensityPasses(
    const IntensityTarget& target, const Device& device);

}  // namespace esvr
