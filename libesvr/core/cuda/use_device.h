#pragma once
/// Makes the device that a caller chose the one that CUDA's calls mean.

#include <string>

#include "core/cuda/check.h"
#include "esvr/device.h"

namespace esvr::cuda {

/// For the calling thread, and for good: going back would wake a device that nobody asked for.
/// \throws DeviceError  it cannot be used (says why), or is the CPU
inline void useDevice(const Device& device) {
  if (device.kind != DeviceKind::kCuda) throw DeviceError("CUDA was asked to use the CPU");
  check(cudaSetDevice(device.index), "using cuda:" + std::to_string(device.index));
}

}  // namespace esvr::cuda
