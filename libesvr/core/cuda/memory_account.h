#pragma once
/// The device memory that all buffers take, and its limits.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "esvr/error.h"

namespace esvr::cuda {

/// An allocation failed or would have exceeded the limit. No memory was allocated.
struct DeviceMemoryError : DeviceError {
  using DeviceError::DeviceError;
};

/// Counts the bytes of buffers: of all of a device, or of a part of them.
class MemoryAccount {
 public:
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

  MemoryAccount() = default;
  /// \param whole  the account of which this is a part; it must outlive this one
  explicit MemoryAccount(MemoryAccount& whole) : whole_(&whole) {}

  /// \throws DeviceMemoryError  the limit, or that of the whole, would be exceeded
  void take(std::size_t bytes) {
    takeOwn(bytes);
    if (!whole_) return;
    try {
      whole_->take(bytes);
    } catch (...) {
      held_ -= bytes;
      throw;
    }
  }
  void give(std::size_t bytes) noexcept {
    held_ -= bytes;
    if (whole_) whole_->give(bytes);
  }

  [[nodiscard]] std::size_t held() const { return held_; }
  /// The largest number of bytes that were held at the same time.
  [[nodiscard]] std::size_t peak() const { return peak_; }
  /// \return the previous limit
  std::size_t setLimit(std::size_t bytes) { return limit_.exchange(bytes); }

 private:
  void takeOwn(std::size_t bytes) {
    std::size_t held = held_.load();
    do {
      const std::size_t limit = limit_.load();
      if (held > limit || bytes > limit - held)
        throw DeviceMemoryError("CUDA: allocating " + std::to_string(bytes) +
                                " bytes on the device beside " + std::to_string(held) +
                                " would exceed the limit of " + std::to_string(limit));
    } while (!held_.compare_exchange_weak(held, held + bytes));
    for (std::size_t peak = peak_.load();
         peak < held + bytes && !peak_.compare_exchange_weak(peak, held + bytes);) {
    }
  }

  MemoryAccount* whole_ = nullptr;
  std::atomic<std::size_t> held_{0}, peak_{0}, limit_{kNoLimit};
};

/// The number of the calling thread's device; useDevice() sets it.
inline int& accountedDevice() {
  thread_local int device = 0;
  return device;
}

/// The account of all buffers of the calling thread's device.
inline MemoryAccount& deviceAccount() {
  constexpr std::size_t kAccounts = 64;  // more devices than a host has
  static std::array<MemoryAccount, kAccounts> accounts;
  return accounts[std::size_t(accountedDevice()) % kAccounts];
}

/// As long as it lives, the buffers that its thread makes on its device are counted on their own, for
/// example those of a fit. Fits on other threads do not count and are not limited, whichever ends first.
/// It must end on the thread that made it, after all of its buffers.
class MemoryShare {
 public:
  /// \param most  bytes that these buffers may take together
  explicit MemoryShare(std::size_t most = MemoryAccount::kNoLimit)
      : device_(accountedDevice()), account_(deviceAccount()) {
    account_.setLimit(most);
    ofThread().push_back(this);
  }
  MemoryShare(const MemoryShare&) = delete;
  MemoryShare& operator=(const MemoryShare&) = delete;
  ~MemoryShare() { std::erase(ofThread(), this); }

  /// The largest number of bytes that its buffers took at the same time.
  [[nodiscard]] std::size_t peak() const { return account_.peak(); }

 private:
  friend MemoryAccount& memoryAccount();
  static std::vector<MemoryShare*>& ofThread() {
    thread_local std::vector<MemoryShare*> shares;
    return shares;
  }

  int device_;
  MemoryAccount account_;
};

/// The account of the buffers that the calling thread makes: that of its latest MemoryShare of its
/// device, or of the whole device.
inline MemoryAccount& memoryAccount() {
  const auto& shares = MemoryShare::ofThread();
  const auto latest = std::find_if(shares.rbegin(), shares.rend(), [](const MemoryShare* share) {
    return share->device_ == accountedDevice();
  });
  return latest == shares.rend() ? deviceAccount() : (*latest)->account_;
}

}  // namespace esvr::cuda
