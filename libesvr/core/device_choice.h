#pragma once
/// Finds and chooses the devices of this machine. The choice does not depend on the machine that runs it,
/// so that it can be tested.

#include <string>
#include <vector>

#include "esvr/device.h"
#include "esvr/error.h"

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

/// Lists the devices that the CUDA runtime finds on this machine, without creating a context on any of
/// them. It is implemented in cuda/probe.cu, and in no_cuda.cpp for a build without CUDA, as is
/// builtWithCuda().
[[nodiscard]] CudaProbe probeCuda();

/// Chooses as selectDevice does, on a machine that `probe` describes. "cuda" and "auto" take the
/// first usable device; "cuda:N" takes device N or fails.
[[nodiscard]] Device chooseDevice(const std::string& text, const CudaProbe& probe);

/// Chooses as selectDevices does, on a machine that `probe` describes.
[[nodiscard]] std::vector<Device> chooseDevices(const std::string& text, const CudaProbe& probe);

/// Refuses CUDA in a build without it.
/// \param work  the operation, for the message: "fitting"
/// \throws DeviceError  always
[[noreturn]] inline void refuseCuda(const std::string& work, const Device& device) {
  throw DeviceError(work + " on cuda:" + std::to_string(device.index) + ": " +
                    probeCuda().whyNoDevices);
}

}  // namespace esvr
