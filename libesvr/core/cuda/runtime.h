#pragma once
/// The CUDA runtime: its errors as exceptions, devices, streams, events, and sizes of launches.

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <source_location>
#include <string>
#include <string_view>
#include <utility>

#include "esvr/device.h"
#include "esvr/error.h"

namespace esvr::cuda {

/// CUDA's own text, except where there is no driver at all, which CUDA calls an insufficient
/// driver.
inline std::string errorText(cudaError_t status) {
  int driver = 0;
  if (status == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver == 0)
    return "no NVIDIA driver";
  return cudaGetErrorString(status);
}

/// Wraps every call of the CUDA runtime; after a launch, check(cudaGetLastError(), "name") is
/// called.
/// \param doing  text for the user that names what failed: "allocating 12 bytes"
/// \throws DeviceError  status is not cudaSuccess; the text has CUDA's own, the file and the line
inline void check(cudaError_t status, std::string_view doing,
                  std::source_location where = std::source_location::current()) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // clears the error, so that the next check() does not report it
  std::string_view file = where.file_name();
  file.remove_prefix(file.rfind('/') + 1);
  throw DeviceError("CUDA, " + std::string(doing) + ": " + errorText(status) + " (" +
                    cudaGetErrorName(status) + ", " + std::string(file) + ":" +
                    std::to_string(where.line()) + ")");
}

/// A stream of the current device that is not synchronised with the default stream. It must outlive
/// the buffers that were made with it.
class Stream {
 public:
  Stream() { check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream"); }
  Stream(Stream&& other) noexcept : stream_(std::exchange(other.stream_, nullptr)) {}
  Stream& operator=(Stream&& other) noexcept {
    std::swap(stream_, other.stream_);
    return *this;
  }
  ~Stream() {
    if (stream_ != nullptr) cudaStreamDestroy(stream_);
  }

  [[nodiscard]] cudaStream_t get() const noexcept { return stream_; }
  void synchronize() const { check(cudaStreamSynchronize(stream_), "waiting for a stream"); }

 private:
  cudaStream_t stream_ = nullptr;
};

/// An event that measures time.
class Event {
 public:
  Event() { check(cudaEventCreate(&event_), "making an event"); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event() { cudaEventDestroy(event_); }

  void record(cudaStream_t stream) { check(cudaEventRecord(event_, stream), "recording an event"); }

  /// Time from `start` to this event. The call waits until both have happened.
  [[nodiscard]] double millisecondsSince(const Event& start) const {
    check(cudaEventSynchronize(event_), "waiting for an event");
    float milliseconds = 0.0f;
    check(cudaEventElapsedTime(&milliseconds, start.event_, event_), "reading a time");
    return double(milliseconds);
  }

 private:
  cudaEvent_t event_ = nullptr;
};

/// The number of the calling thread's device; useDevice() sets it.
inline int& accountedDevice() {
  thread_local int device = 0;
  return device;
}

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

inline constexpr int kWarp = 32;
inline constexpr int kBlock = 256;  ///< usual number of threads in a block

/// \return the number of blocks that cover `items`, with `perBlock` in each
/// \throws DeviceError  a launch cannot have so many blocks
inline unsigned blocksFor(std::size_t items, std::size_t perBlock) {
  const std::size_t blocks = items / perBlock + (items % perBlock != 0);
  if (blocks > std::size_t(std::numeric_limits<int>::max()))
    throw DeviceError("CUDA: a launch of " + std::to_string(blocks) + " blocks is too large");
  return unsigned(blocks);
}

/// Largest number in 32 bits with which a loop that advances by the threads of a block ends before it wraps.
inline constexpr std::size_t kMaxCount32 = std::numeric_limits<std::uint32_t>::max() - 1024;

/// \param what  plural for the message, for example "pairs"
/// \throws DeviceError  the count is too large for kernels
[[nodiscard]] inline std::uint32_t count32(std::size_t count, const char* what) {
  if (count > kMaxCount32)
    throw DeviceError("CUDA: " + std::to_string(count) + " " + what +
                      " are more than kernels can number");
  return std::uint32_t(count);
}

}  // namespace esvr::cuda
