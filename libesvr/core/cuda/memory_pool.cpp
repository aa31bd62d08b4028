/// The pool of device memory (device_buffer.h).

#include <cstdint>
#include <limits>
#include <map>
#include <mutex>

#include "core/cuda/device_buffer.h"

namespace esvr::cuda {
namespace {

int currentDevice() {
  int device = 0;
  check(cudaGetDevice(&device), "asking for the current device");
  return device;
}

cudaMemPool_t poolOf(int device) {
  cudaMemPool_t pool{};
  check(cudaDeviceGetDefaultMemPool(&pool, device), "asking for the memory pool");
  return pool;
}

std::uint64_t attribute(cudaMemPoolAttr which) {
  std::uint64_t value = 0;
  check(cudaMemPoolGetAttribute(poolOf(currentDevice()), which, &value),
        "asking for the pool's memory");
  return value;
}

/// The number of objects that keep a device's memory, and the threshold to restore after them.
struct Keepers {
  std::size_t count = 0;
  std::uint64_t threshold = 0;
};
std::mutex keepersMutex;
std::map<int, Keepers> keepersOf;

}  // namespace

KeepFreedMemory::KeepFreedMemory() : device_(currentDevice()) {
  const std::lock_guard lock(keepersMutex);
  Keepers& keepers = keepersOf[device_];
  if (keepers.count == 0) {
    const cudaMemPool_t pool = poolOf(device_);
    check(cudaMemPoolGetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keepers.threshold),
          "asking for the memory pool's settings");
    auto all = std::numeric_limits<std::uint64_t>::max();
    check(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &all),
          "setting up the memory pool");
  }
  ++keepers.count;
}

KeepFreedMemory::~KeepFreedMemory() {
  const std::lock_guard lock(keepersMutex);
  Keepers& keepers = keepersOf[device_];
  if (--keepers.count > 0) return;
  cudaMemPool_t pool{};
  if (cudaDeviceGetDefaultMemPool(&pool, device_) == cudaSuccess)
    cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &keepers.threshold);
}

void trimMemoryPool() {
  check(cudaDeviceSynchronize(), "waiting for the device");
  check(cudaMemPoolTrimTo(poolOf(currentDevice()), 0), "giving back memory");
}

std::size_t availableMemory() {
  std::size_t free = 0, total = 0;
  check(cudaMemGetInfo(&free, &total), "asking for the free memory");
  return free + attribute(cudaMemPoolAttrReservedMemCurrent);
}

}  // namespace esvr::cuda
