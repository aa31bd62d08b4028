#pragma once
/// Allocates device memory within the account's limit.

#include <cuda_runtime_api.h>

#include <limits>
#include <string>

#include "core/cuda/check.h"
#include "core/cuda/memory_account.h"

namespace esvr::cuda {

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

}  // namespace esvr::cuda
