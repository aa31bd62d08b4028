#pragma once
/// The device that computes.

#include <string>
#include <vector>

namespace esvr {

enum class DeviceKind { kCpu, kCuda };

struct Device {
  DeviceKind kind = DeviceKind::kCpu;
  int index = 0;  ///< the CUDA device's number
};

/// True where the library was built with CUDA (which says nothing of a GPU being there).
[[nodiscard]] bool builtWithCuda() noexcept;

/// Names of the usable CUDA devices; empty without CUDA, driver or GPU.
[[nodiscard]] std::vector<std::string> cudaDevices();

/// "auto", "cpu", "cuda", "cuda:N". auto takes a CUDA device where one is usable, else the CPU.
/// \throws UsageError  another text; DeviceError: CUDA asked for and not there (says why)
[[nodiscard]] Device selectDevice(const std::string& text);

/// "CPU", or the GPU's name and place: "NVIDIA H200 (cuda:0)".
[[nodiscard]] std::string deviceName(const Device& device);

/// "CUDA 13.0, driver 580.159" or "no CUDA": for --version.
[[nodiscard]] std::string cudaVersions();

}  // namespace esvr
