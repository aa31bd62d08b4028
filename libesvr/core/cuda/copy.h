#pragma once
/// Copies between host and device in the order of a stream.

#include <span>

#include "core/cuda/check.h"

namespace esvr::cuda {

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

}  // namespace esvr::cuda
