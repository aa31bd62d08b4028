#pragma once
/// The device memory that all buffers take, and its limit.

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

/// Counts the bytes of all buffers of the process.
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

/// The account of the process.
inline MemoryAccount& memoryAccount() {
  static MemoryAccount account;
  return account;
}

/// As long as it lives, limits the memory that buffers take in addition to what they take now.
class LimitMemory {
 public:
  explicit LimitMemory(std::size_t bytes)
      : before_(memoryAccount().setLimit(memoryAccount().held() + bytes)) {}
  LimitMemory(const LimitMemory&) = delete;
  LimitMemory& operator=(const LimitMemory&) = delete;
  ~LimitMemory() { memoryAccount().setLimit(before_); }

 private:
  std::size_t before_;
};

}  // namespace esvr::cuda
