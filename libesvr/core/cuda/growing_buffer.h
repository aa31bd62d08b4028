#pragma once
/// Device memory that grows and is reused.

#include "core/cuda/device_buffer.h"

namespace esvr::cuda {

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

}  // namespace esvr::cuda
