/// The devices that the CUDA runtime finds on this machine.

#include <cuda_runtime_api.h>

#include <fstream>
#include <regex>
#include <string>

#include "core/cuda/runtime.h"
#include "core/device_choice.h"
#include "esvr/device.h"

namespace esvr {
namespace {

// The architectures for which this build has code, increasing; 900 is sm_90.
constexpr int kArchitectures[] = {__CUDA_ARCH_LIST__};

std::string version(int packed) {
  return std::to_string(packed / 1000) + "." + std::to_string(packed % 1000 / 10);
}

int attribute(cudaDeviceAttr which, int index) {
  int value = 0;
  return cudaDeviceGetAttribute(&value, which, index) == cudaSuccess ? value : 0;
}

/// Refuses devices that are older than all code of this build. Whether a newer device can run the
/// code is known only when a kernel starts.
std::string whyNotUsable(int index) {
  const int major = attribute(cudaDevAttrComputeCapabilityMajor, index);
  const int minor = attribute(cudaDevAttrComputeCapabilityMinor, index);
  if (major * 100 + minor * 10 < kArchitectures[0])
    return "compute capability " + std::to_string(major) + "." + std::to_string(minor) +
           ", this build begins at " + std::to_string(kArchitectures[0] / 100) + "." +
           std::to_string(kArchitectures[0] / 10 % 10);
  if (attribute(cudaDevAttrComputeMode, index) == cudaComputeModeProhibited)
    return "its compute mode is 'prohibited'";
  return {};
}

CudaDevice describe(int index) {
  cudaDeviceProp properties{};
  const auto status = cudaGetDeviceProperties(&properties, index);
  if (status != cudaSuccess) return {index, "unknown", cuda::errorText(status)};
  return {index, properties.name, whyNotUsable(index)};
}

/// The version of the kernel module, which people know as the driver version. The runtime only
/// knows the CUDA version that the driver supports.
std::string driverVersion() {
  int cudaOfDriver = 0;
  if (cudaDriverGetVersion(&cudaOfDriver) != cudaSuccess || cudaOfDriver == 0) return "no driver";
  std::ifstream file("/proc/driver/nvidia/version");
  std::string line;
  std::smatch match;
  if (std::getline(file, line) &&
      std::regex_search(line, match, std::regex(R"(\s(\d+\.\d+(\.\d+)?)\s)")))
    return "driver " + match[1].str();
  return "driver for CUDA " + version(cudaOfDriver);
}

std::string versions() {
  int runtime = 0;
  cudaRuntimeGetVersion(&runtime);
  return "CUDA " + version(runtime) + ", " + driverVersion();
}

}  // namespace

bool builtWithCuda() noexcept { return true; }

void startDevice(const Device& device) noexcept {
  if (device.kind != DeviceKind::kCuda) return;
  cudaSetDevice(device.index);
  cudaFree(nullptr);   // creates the context
  cudaGetLastError();  // an error of this thread must not remain
}

std::uint64_t freeDeviceMemory(const Device& device) {
  if (device.kind != DeviceKind::kCuda) return 0;
  cuda::useDevice(device);
  std::size_t free = 0, total = 0;
  cuda::check(cudaMemGetInfo(&free, &total), "asking for the free memory");
  return free;
}

CudaProbe probeCuda() {
  CudaProbe probe{.versions = versions(), .devices = {}, .whyNoDevices = {}};
  int count = 0;
  const auto status = cudaGetDeviceCount(&count);
  if (status != cudaSuccess) {
    cudaGetLastError();  // a machine without a GPU must not fail later calls
    probe.whyNoDevices = cuda::errorText(status);
  } else if (count == 0) {
    probe.whyNoDevices = "the driver shows none";
  }
  for (int i = 0; i < count; ++i) probe.devices.push_back(describe(i));
  return probe;
}

}  // namespace esvr
