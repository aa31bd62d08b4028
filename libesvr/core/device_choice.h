#pragma once
/// The rule by which a --device text becomes a device, apart from the machine it runs on.

#include <string>

#include "core/cuda_probe.h"
#include "esvr/device.h"

namespace esvr {

/// As selectDevice, on a machine that `probe` describes. "cuda" and "auto" take the first usable
/// device; "cuda:N" takes that one or nothing.
[[nodiscard]] Device chooseDevice(const std::string& text, const CudaProbe& probe);

}  // namespace esvr
