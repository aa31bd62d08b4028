#pragma once
/// Which of all threads or warps of a launch this is, and how many warps there are, in 64 bits.

#include <cstddef>

#include "core/cuda/launch.h"

namespace esvr::cuda {

__device__ inline std::size_t threadNumber() {
  return std::size_t(blockIdx.x) * blockDim.x + threadIdx.x;
}
__device__ inline std::size_t warpNumber() { return threadNumber() / kWarp; }
__device__ inline std::size_t warpCount() { return std::size_t(gridDim.x) * blockDim.x / kWarp; }

}  // namespace esvr::cuda
