#pragma once
/// The device memory that all buffers take, and its limit.

#include <array>
#include <atomic>
#include <cstddef>
#include <limits>
#include <string>

#include "esvr/error.h"

namespace esvr::cuda {

/// An allocation failed or would have exceeded the limit. No memory was allocated.
struct DeviceMemoryError : DeviceError {
  using DeviceError::DeviceError;
};

/// Counts the bytes of all buffers of a device.
class MemoryAccount {
 public:
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

  /// \throws DeviceMemoryError  the limit would be exceeded
  void take(std::size_t bytes) {
    std::size_t held = held_.load();
    do {
      const std::size_t limit = limit_.load();
      if (held > limit || bytes > limit - held)
        throw DeviceMemoryError("CUDA: allocating " + std::to_string(bytes) +
                                " bytes on the device beside " + std::to_string(held) +
                                " would exceed the limit of " + std::to_string(limit));
    } while (!held_.compare_exchange_weak(held, held + bytes));
  }
  void give(std::size_t bytes) noexcept { held_ -= bytes; }

  [[nodiscard]] std::size_t held() const { return held_; }
  /// \return the previous limit
  std::size_t setLimit(std::size_t bytes) { return limit_.exchange(bytes); }

 private:
  std::atomic<std::size_t> held_{0}, limit_{kNoLimit};
};

/// The number of the calling thread's device; useDevice() sets it.
inline int& accountedDevice() {
  thread_local int device = 0;
  return device;
}

/// The account of the calling thread's device.
inline MemoryAccount& memoryAccount() {
  constexpr std::size_t kAccounts = 64;  // more devices than a host has
  static std::array<MemoryAccount, kAccounts> accounts;
  return accounts[std::size_t(accountedDevice()) % kAccounts];
}

/// As long as it lives, limits the memory that buffers of the thread's device take in addition to
/// what they take now. If several limits of a device exist at the same time, the one that was made
/// last must end first.
class LimitMemory {
 public:
  explicit LimitMemory(std::size_t bytes)
      : account_(memoryAccount()), before_(account_.setLimit(account_.held() + bytes)) {}
  LimitMemory(const LimitMemory&) = delete;
  LimitMemory& operator=(const LimitMemory&) = delete;
  ~LimitMemory() { account_.setLimit(before_); }

 private:
  MemoryAccount& account_;
  std::size_t before_;
};

}  // namespace esvr::cuda
