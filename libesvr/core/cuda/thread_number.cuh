#pragma once
/// The 64-bit number of a thread, and of a warp, in its launch.

#include <cstddef>

#include "core/cuda/launch.h"

namespace esvr::cuda {

__device__ inline std::size_t threadNumber() {
  return std::size_t(blockIdx.x) * blockDim.x + threadIdx.x;
}
__device__ inline std::size_t warpNumber() { return threadNumber() / kWarp; }

}  // namespace esvr::cuda
