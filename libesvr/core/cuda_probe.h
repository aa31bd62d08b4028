#pragma once
/// Lists the devices that the CUDA runtime finds on this machine. It is implemented in
/// cuda/probe.cu, and in no_cuda.cpp for a build without CUDA, as is builtWithCuda(). device.cpp
/// depends only on this header.

#include <string>
#include <vector>

namespace esvr {

struct CudaDevice {
  int index = 0;             ///< number that the runtime gives it
  std::string name;          ///< "NVIDIA H200"
  std::string whyNotUsable;  ///< empty if kernels of this build can run on it
};

struct CudaProbe {
  std::string versions;             ///< see cudaVersions()
  std::vector<CudaDevice> devices;  ///< all devices that the driver shows
  std::string whyNoDevices;         ///< empty if there are devices
};

/// Asks the driver, without creating a context on any device.
[[nodiscard]] CudaProbe probeCuda();

}  // namespace esvr
