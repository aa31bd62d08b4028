#pragma once
/// The CUDA runtime's view of this machine. It is implemented by cuda/probe.cu, and by no_cuda.cpp
/// in a build without CUDA, as builtWithCuda() is; device.cpp knows only this.

#include <string>
#include <vector>

namespace esvr {

struct CudaDevice {
  int index = 0;             ///< the runtime's
  std::string name;          ///< "NVIDIA H200"
  std::string whyNotUsable;  ///< empty where kernels of this build run on it
};

struct CudaProbe {
  std::string versions;             ///< as cudaVersions() returns them
  std::vector<CudaDevice> devices;  ///< all that the driver shows
  std::string whyNoDevices;         ///< empty where there are some
};

/// Asks the driver; creates no context on any device.
[[nodiscard]] CudaProbe probeCuda();

}  // namespace esvr
