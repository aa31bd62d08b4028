/// What a build without CUDA says about devices.

#include "core/device_choice.h"
#include "esvr/device.h"

namespace esvr {

bool builtWithCuda() noexcept { return false; }

void startDevice(const Device&) noexcept {}

std::uint64_t freeDeviceMemory(const Device&) { return 0; }

CudaProbe probeCuda() {
  return {.versions = "no CUDA", .devices = {}, .whyNoDevices = "this build has no CUDA"};
}

}  // namespace esvr
