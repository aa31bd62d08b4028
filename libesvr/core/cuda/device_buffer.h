#pragma once
/// Memory of the device: the account of what all buffers take and its limits, the pool that it comes from,
/// buffers that own it, copies, and page-locked memory of the host.

#include <cuda_runtime_api.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/cuda/runtime.h"
#include "esvr/error.h"

namespace esvr::cuda {

// The account.

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

// The pool from which the stream-ordered allocations of a device take memory.

/// As long as one of these lives, freed memory of the current device stays in its pool. A fit
/// allocates anew at every event; without this, memory would be returned and requested again at
/// every synchronisation. The last one restores the setting that the first one found.
class KeepFreedMemory {
 public:
  KeepFreedMemory();
  KeepFreedMemory(const KeepFreedMemory&) = delete;
  KeepFreedMemory& operator=(const KeepFreedMemory&) = delete;
  ~KeepFreedMemory();

 private:
  int device_ = 0;
};

/// Returns memory of the current device's pool that no buffer uses to the device. It waits for all
/// earlier work on the device's streams.
void trimMemoryPool();

/// \return bytes that are free on the current device, plus those that its pool holds, used or not
[[nodiscard]] std::size_t availableMemory();

// Buffers.

[[noreturn]] inline void refuseAllocation(std::size_t count, std::size_t each, cudaError_t status) {
  cudaGetLastError();  // clears the error, so that the next check() does not report it
  throw DeviceMemoryError("CUDA, allocating " + std::to_string(count) + " times " +
                          std::to_string(each) + " bytes on the device: " + errorText(status) +
                          " (" + cudaGetErrorName(status) + ")");
}

/// \return memory for `count` elements of `each` bytes, in the order of a stream; the caller frees
///         it with cudaFreeAsync and gives the bytes back to the account
/// \throws DeviceMemoryError  the device has too little memory, or the account's limit is lower
inline void* allocate(std::size_t count, std::size_t each, cudaStream_t stream) {
  if (count > std::numeric_limits<std::size_t>::max() / each)
    refuseAllocation(count, each, cudaErrorMemoryAllocation);
  const std::size_t bytes = count * each;
  memoryAccount().take(bytes);
  void* memory = nullptr;
  const cudaError_t status = cudaMallocAsync(&memory, bytes, stream);
  if (status == cudaSuccess) return memory;
  memoryAccount().give(bytes);
  if (status == cudaErrorMemoryAllocation) refuseAllocation(count, each, status);
  check(status, "allocating on the device");
  return nullptr;
}

/// n elements of device memory, allocated and freed in the order of a stream. The class is
/// move-only, so that every copy is an explicit call.
template <class T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "copied as bytes");

 public:
  DeviceBuffer() = default;
  /// Allocates memory and leaves it uninitialised.
  /// \throws DeviceMemoryError  there is too little memory (the text says how much was asked for)
  DeviceBuffer(std::size_t size, cudaStream_t stream) : size_(size), stream_(stream) {
    if (size > 0) data_ = static_cast<T*>(allocate(size, sizeof(T), stream));
  }
  DeviceBuffer(std::span<const T> from, cudaStream_t stream) : DeviceBuffer(from.size(), stream) {
    upload(from);
  }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~DeviceBuffer() {
    if (data_ == nullptr) return;
    cudaFreeAsync(data_, stream_);
    account_->give(bytes());
  }

  [[nodiscard]] T* data() noexcept { return data_; }
  [[nodiscard]] const T* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return size_ * sizeof(T); }

  /// Copies size() elements to the device. `from` may be used again after the call.
  void upload(std::span<const T> from) {
    requireSize(from.size());
    if (size_ == 0) return;
    check(cudaMemcpyAsync(data_, from.data(), bytes(), cudaMemcpyHostToDevice, stream_),
          "copying to the device");
    // The copy from pinned memory may still be running here.
    check(cudaStreamSynchronize(stream_), "copying to the device");
  }
  /// Copies size() elements to the host, after all earlier work of the stream.
  void download(std::span<T> to) const {
    requireSize(to.size());
    check(cudaMemcpyAsync(to.data(), data_, bytes(), cudaMemcpyDeviceToHost, stream_),
          "copying from the device");
    check(cudaStreamSynchronize(stream_), "copying from the device");
  }
  void setZero() {
    if (data_ != nullptr) check(cudaMemsetAsync(data_, 0, bytes(), stream_), "zeroing memory");
  }

 private:
  void requireSize(std::size_t n) const {
    if (n != size_) throw std::logic_error("DeviceBuffer: copy of another size");
  }
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(stream_, other.stream_);
    std::swap(account_, other.account_);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  cudaStream_t stream_ = nullptr;
  MemoryAccount* account_ = &memoryAccount();
};

/// Makes room for at least n elements, without any to spare. What was there is lost when it has to
/// grow.
template <class T>
void makeRoom(DeviceBuffer<T>& buffer, std::size_t n, cudaStream_t stream) {
  if (buffer.size() >= n) return;
  buffer = {};  // first freed, so that both are never held at once
  buffer = DeviceBuffer<T>(n, stream);
}

/// Room for n elements. Growing leaves some to spare, so that sizes which creep up from call to
/// call do not allocate each time.
template <class T>
class GrowingBuffer {
 public:
  explicit GrowingBuffer(cudaStream_t stream) : stream_(stream) {}

  /// Makes room for at least n elements. If the buffer grows, its content is lost.
  T* reserve(std::size_t n) {
    if (n > buffer_.size()) makeRoom(buffer_, withSpare(n), stream_);
    return buffer_.data();
  }
  /// Makes room for at least n elements and keeps the first `kept` of them.
  T* extend(std::size_t n, std::size_t kept) {
    if (n > buffer_.size()) {
      DeviceBuffer<T> larger(withSpare(n), stream_);
      if (kept > 0)
        check(cudaMemcpyAsync(larger.data(), buffer_.data(), kept * sizeof(T),
                              cudaMemcpyDeviceToDevice, stream_),
              "copying on the device");
      buffer_ = std::move(larger);
    }
    return buffer_.data();
  }
  /// Frees the memory; the content is lost.
  void release() { buffer_ = {}; }
  [[nodiscard]] T* data() { return buffer_.data(); }
  [[nodiscard]] const T* data() const { return buffer_.data(); }
  [[nodiscard]] std::size_t bytes() const { return buffer_.bytes(); }

 private:
  static std::size_t withSpare(std::size_t n) { return n + n / 4; }
  DeviceBuffer<T> buffer_;
  cudaStream_t stream_;
};

/// Calls a function of CUB twice: once to get the size of its temporary memory, and once with it.
/// \param call  call(void* temporary, std::size_t& bytes) -> cudaError_t
template <class Call>
void withTemporary(GrowingBuffer<char>& memory, const char* doing, Call&& call) {
  std::size_t bytes = 0;
  check(call(nullptr, bytes), doing);
  check(call(memory.reserve(bytes > 0 ? bytes : 1), bytes), doing);
}

// Copies in the order of a stream.

template <class T>
void uploadTo(T* device, std::span<const T> host, cudaStream_t stream) {
  if (host.empty()) return;
  check(cudaMemcpyAsync(device, host.data(), host.size_bytes(), cudaMemcpyHostToDevice, stream),
        "copying to the device");
  check(cudaStreamSynchronize(stream), "copying to the device");
}

template <class T>
void downloadTo(std::span<T> host, const T* device, cudaStream_t stream) {
  if (host.empty()) return;
  check(cudaMemcpyAsync(host.data(), device, host.size_bytes(), cudaMemcpyDeviceToHost, stream),
        "copying from the device");
  check(cudaStreamSynchronize(stream), "copying from the device");
}

template <class T>
[[nodiscard]] T downloadValue(const T* device, cudaStream_t stream) {
  T value;
  downloadTo(std::span<T>(&value, 1), device, stream);
  return value;
}

/// A value in page-locked host memory, which the device writes without a copy in between.
template <class T>
class Pinned {
  static_assert(std::is_trivially_copyable_v<T>, "copied as bytes");

 public:
  Pinned() {
    void* memory = nullptr;
    check(cudaMallocHost(&memory, sizeof(T)), "allocating page-locked memory");
    value_ = new (memory) T{};
  }
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;
  ~Pinned() { cudaFreeHost(value_); }

  /// Downloads a value after all earlier work of the stream.
  const T& download(const T* device, cudaStream_t stream) {
    check(cudaMemcpyAsync(value_, device, sizeof(T), cudaMemcpyDeviceToHost, stream),
          "copying from the device");
    check(cudaStreamSynchronize(stream), "copying from the device");
    return *value_;
  }

 private:
  T* value_;
};

}  // namespace esvr::cuda
