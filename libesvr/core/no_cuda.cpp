#include "core/cuda_probe.h"
#include "esvr/device.h"

namespace esvr {

bool builtWithCuda() noexcept { return false; }

void startDevice(const Device&) noexcept {}

CudaProbe probeCuda() {
  return {.versions = "no CUDA", .devices = {}, .whyNoDevices = "this build has no CUDA"};
}

}  // namespace esvr
