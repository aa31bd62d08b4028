#pragma once
/// Device memory that grows and is reused.

#include "core/cuda/device_buffer.h"

namespace esvr::cuda {

/// A buffer that has room for n elements. It allocates more than asked for, so that sizes which
/// grow slowly from call to call do not allocate each time.
template <class T>
class GrowingBuffer {
 public:
  explicit GrowingBuffer(cudaStream_t stream) : stream_(stream) {}

  /// Makes room for at least n elements. If the buffer grows, its content is lost.
  T* reserve(std::size_t n) {
    if (n > buffer_.size()) {
      buffer_ = {};  // freed first, so that both are never allocated at once
      buffer_ = DeviceBuffer<T>(withSpare(n), stream_);
    }
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

}  // namespace esvr::cuda
