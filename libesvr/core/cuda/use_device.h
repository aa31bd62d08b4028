#pragma once
/// Makes the device that a caller chose the one that CUDA's calls mean.

#include <string>

#include "core/cuda/stream.h"
#include "esvr/device.h"

namespace esvr::cuda {

/// For the calling thread, and for good: going back would wake a device that nobody asked for.
/// \throws DeviceError  it cannot be used (says why), or is the CPU
inline void useDevice(const Device& device) {
  if (device.kind != DeviceKind::kCuda) throw DeviceError("CUDA was asked to use the CPU");
  check(cudaSetDevice(device.index), "using cuda:" + std::to_string(device.index));
}

/// Uses the device and makes a stream of it.
[[nodiscard]] inline Stream streamOn(const Device& device) {
  useDevice(device);
  return Stream();
}

[[nodiscard]] inline int multiprocessorsOf(const Device& device) {
  int count = 0;
  check(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, device.index),
        "asking for the number of multiprocessors");
  return count;
}

}  // namespace esvr::cuda
