#pragma once
/// A value in page-locked host memory, which the device writes without a copy in between.

#include <cuda_runtime_api.h>

#include <type_traits>

#include "core/cuda/check.h"

namespace esvr::cuda {

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
