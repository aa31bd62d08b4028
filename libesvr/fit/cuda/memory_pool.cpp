#include "fit/cuda/memory_pool.h"

#include <cstdint>
#include <limits>

#include "core/cuda/check.h"

namespace esvr::cuda {

void keepFreedMemory() {
  int device = 0;
  check(cudaGetDevice(&device), "asking for the current device");
  cudaMemPool_t pool{};
  check(cudaDeviceGetDefaultMemPool(&pool, device), "asking for the memory pool");
  auto threshold = std::numeric_limits<std::uint64_t>::max();
  check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &threshold),
        "setting up the memory pool");
}

}  // namespace esvr::cuda
