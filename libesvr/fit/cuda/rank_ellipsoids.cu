#include <algorithm>
#include <cub/device/device_radix_sort.cuh>
#include <limits>

#include "core/cuda/copy.h"
#include "core/cuda/launch.h"
#include "core/cuda/temporary.h"
#include "core/cuda/thread_number.cuh"
#include "fit/cuda/rank_ellipsoids.h"
#include "fit/parameter_gradient.h"

namespace esvr::cuda {
namespace {

__global__ void writeKeys(const StepArguments a, std::uint32_t graceSteps, float* keys,
                          std::uint32_t* places, std::uint32_t* settled) {
  const std::size_t i = threadNumber();
  if (i >= a.ellipsoidCount) return;
  const bool old = a.states[i].steps >= graceSteps;
  places[i] = i;
  keys[i] = std::numeric_limits<float>::infinity();
  if (!old) return;
  const Usefulness u = a.usefulness[i];
  keys[i] = float(removalError(a.ellipsoids[i].intensity, double(u.phi2), double(u.rPhi)));
  atomicAdd(settled, 1u);
}

}  // namespace

EllipsoidRanking::EllipsoidRanking(cudaStream_t stream)
    : stream_(stream),
      keys_(stream),
      sortedKeys_(stream),
      places_(stream),
      sortedPlaces_(stream),
      settled_(stream),
      temporary_(stream) {}

EllipsoidRanking::Chosen EllipsoidRanking::leastUseful(const StepArguments& fit, std::size_t count,
                                                       int graceSteps) {
  const std::size_t n = fit.ellipsoidCount;
  if (n == 0) return {nullptr, 0};
  std::uint32_t* const settled = settled_.reserve(1);
  check(cudaMemsetAsync(settled, 0, sizeof(*settled), stream_), "clearing a counter");
  writeKeys<<<blocksFor(n, kBlock), kBlock, 0, stream_>>>(
      fit, std::uint32_t(graceSteps), keys_.reserve(n), places_.reserve(n), settled);
  check(cudaGetLastError(), "ranking ellipsoids");
  withTemporary(temporary_, "ranking ellipsoids", [&](void* memory, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, keys_.data(), sortedKeys_.reserve(n),
                                           places_.data(), sortedPlaces_.reserve(n), n, 0,
                                           int(8 * sizeof(float)), stream_);
  });
  return {sortedPlaces_.data(), std::min<std::size_t>(count, downloadValue(settled, stream_))};
}

}  // namespace esvr::cuda
