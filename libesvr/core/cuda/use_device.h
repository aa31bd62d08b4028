#pragma once
/// Makes the selected device the current one of the CUDA runtime.

#include <string>

#include "core/cuda/memory_account.h"
#include "core/cuda/stream.h"
#include "esvr/device.h"

namespace esvr::cuda {

/// Sets the calling thread's device and does not restore the previous one, because that would
/// initialise a device that nobody asked for.
/// \throws DeviceError  the device cannot be used (the text says why) or is the CPU
inline void useDevice(const Device& device) {
  if (device.kind != DeviceKind::kCuda) throw DeviceError("CUDA was asked to use the CPU");
  check(cudaSetDevice(device.index), "using cuda:" + std::to_string(device.index));
  accountedDevice() = device.index;
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
