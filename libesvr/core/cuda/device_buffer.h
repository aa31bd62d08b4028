#pragma once
/// Ownership of device memory.

#include <cstddef>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "core/cuda/allocate.h"
#include "core/cuda/check.h"

namespace esvr::cuda {

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

}  // namespace esvr::cuda
