#pragma once
/// Chooses a device by the text of --device. The choice does not depend on the machine that runs
/// it, so that it can be tested.

#include <string>
#include <vector>

#include "core/cuda_probe.h"
#include "esvr/device.h"

namespace esvr {

/// Chooses as selectDevice does, on a machine that `probe` describes. "cuda" and "auto" take the
/// first usable device; "cuda:N" takes device N or fails.
[[nodiscard]] Device chooseDevice(const std::string& text, const CudaProbe& probe);

/// Chooses as selectDevices does, on a machine that `probe` describes.
[[nodiscard]] std::vector<Device> chooseDevices(const std::string& text, const CudaProbe& probe);

}  // namespace esvr
