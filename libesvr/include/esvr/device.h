#pragma once
/// Selects the device that computes.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace esvr {

enum class DeviceKind { kCpu, kCuda };

struct Device {
  DeviceKind kind = DeviceKind::kCpu;
  int index = 0;  ///< number of the CUDA device
  friend bool operator==(const Device&, const Device&) = default;
};

/// Is told that a device failed and is not used any more, and why, while other devices go on. It may be
/// called on any thread.
using LostDevice = std::function<void(const Device& device, const std::string& why)>;

/// True if the library was built with CUDA, whether or not the machine has a GPU.
[[nodiscard]] bool builtWithCuda() noexcept;

/// Selects a device by name: "auto", "cpu", "cuda" or "cuda:N". "auto" selects a CUDA device if one
/// is usable, otherwise the CPU.
/// \throws UsageError   the text is none of these names
/// \throws DeviceError  the CUDA device cannot be used (the text says why)
[[nodiscard]] Device selectDevice(const std::string& text);

/// Selects one or more devices: "cuda:0,1,3" (each number may be repeated), "cuda:all" (all usable
/// CUDA devices), or a name that selectDevice() takes.
/// \return at least one device
/// \throws UsageError, DeviceError  see selectDevice()
[[nodiscard]] std::vector<Device> selectDevices(const std::string& text);

/// Starts a device, which takes some tenths of a second for a GPU, so that its first use need not
/// wait. It may be called on another thread. It reports no error, because the first use does.
void startDevice(const Device& device) noexcept;

/// Free memory of a GPU in bytes; 0 for the CPU.
/// \throws DeviceError  the GPU cannot be used
[[nodiscard]] std::uint64_t freeDeviceMemory(const Device& device);

/// The name of a device: "CPU", or the GPU's name and number, "NVIDIA H200 (cuda:0)".
[[nodiscard]] std::string deviceName(const Device& device);

/// Versions for --version: "CUDA 13.0, driver 580.159", or "no CUDA".
[[nodiscard]] std::string cudaVersions();

}  // namespace esvr
