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

/// n elements of device memory, allocated and freed in the order of a stream. Move-only: a copy is
/// always an explicit call, so that none happens unseen.
template <class T>
class DeviceBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "copied as bytes");

 public:
  DeviceBuffer() = default;
  /// Uninitialised. \throws DeviceMemoryError  out of memory (says how much was asked for)
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
    memoryAccount().give(bytes());
  }

  [[nodiscard]] T* data() noexcept { return data_; }
  [[nodiscard]] const T* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return size_ * sizeof(T); }

  /// Copies size() elements in; `from` may be reused on return.
  void upload(std::span<const T> from) {
    requireSize(from.size());
    if (size_ == 0) return;
    check(cudaMemcpyAsync(data_, from.data(), bytes(), cudaMemcpyHostToDevice, stream_),
          "copying to the device");
    // Pinned memory would still be read after the call.
    check(cudaStreamSynchronize(stream_), "copying to the device");
  }
  /// Copies size() elements out, when all that was put on the stream before is done.
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
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  cudaStream_t stream_ = nullptr;
};

}  // namespace esvr::cuda
