#pragma once
/// Numbers of threads and warps, reductions and running sums over the lanes of a warp, and reductions over
/// the threads of a block. Each has one order, so that sums of floating-point numbers are the same bits in
/// every run.

#include <cub/block/block_reduce.cuh>

#include <cstddef>
#include <cstdint>

#include "core/cuda/runtime.h"

namespace esvr::cuda {

/// Which of all threads or warps of a launch this is, and how many warps there are, in 64 bits.
__device__ inline std::size_t threadNumber() {
  return std::size_t(blockIdx.x) * blockDim.x + threadIdx.x;
}
__device__ inline std::size_t warpNumber() { return threadNumber() / kWarp; }
__device__ inline std::size_t warpCount() { return std::size_t(gridDim.x) * blockDim.x / kWarp; }

inline constexpr unsigned kAllLanes = 0xffffffffu;

/// The lanes of this thread's group, if a warp is divided into groups of kLanes (a power of two).
template <int kLanes>
__device__ inline unsigned lanesOfGroup() {
  if constexpr (kLanes == kWarp) return kAllLanes;
  return ((1u << kLanes % kWarp) - 1u) << (threadIdx.x % kWarp / kLanes * kLanes);
}

/// Combines the values of a group's lanes. Every lane gets the result.
template <int kLanes, class T, class Combine>
__device__ inline T reduceLanes(T value, Combine&& combine) {
  const unsigned group = lanesOfGroup<kLanes>();
  for (int d = kLanes / 2; d > 0; d /= 2) value = combine(value, __shfl_xor_sync(group, value, d));
  return value;
}

template <int kLanes, class T>
__device__ inline T groupSum(T value) {
  return reduceLanes<kLanes>(value, [](T a, T b) { return a + b; });
}
template <class T>
__device__ inline T warpSum(T value) {
  return groupSum<kWarp>(value);
}
template <class T>
__device__ inline T warpMin(T value) {
  return reduceLanes<kWarp>(value, [](T a, T b) { return a < b ? a : b; });
}
/// The largest value of a warp. NaN is ignored.
__device__ inline float warpMax(float value) {
  return reduceLanes<kWarp>(value, [](float a, float b) { return fmaxf(a, b); });
}
__device__ inline double warpMax(double value) {
  return reduceLanes<kWarp>(value, [](double a, double b) { return fmax(a, b); });
}

/// Without __reduce_or_sync, which devices before sm_80 lack.
__device__ inline std::uint32_t warpOr(std::uint32_t bits) {
  return reduceLanes<kWarp>(bits, [](std::uint32_t a, std::uint32_t b) { return a | b; });
}

/// The sum over the lanes below this one. To be called by all lanes of a warp.
template <class T>
__device__ inline T warpSumBelow(T value) {
  T sum = value;
  for (unsigned d = 1; d < kWarp; d *= 2) {
    const T below = __shfl_up_sync(kAllLanes, sum, d);
    if (threadIdx.x % kWarp >= d) sum += below;
  }
  return sum - value;
}

/// The largest value of a block; every thread gets it. The block can call it again at once.
template <int kThreads>
__device__ inline float blockMax(float value) {
  __shared__ float parts[kThreads / kWarp];
  value = warpMax(value);
  if (threadIdx.x % kWarp == 0) parts[threadIdx.x / kWarp] = value;
  __syncthreads();
  for (const float part : parts) value = fmaxf(value, part);
  __syncthreads();
  return value;
}

/// The sum of a block's values, which thread 0 gets. A kernel can call it once only.
template <int kThreads>
__device__ inline double blockSum(double value) {
  using Reduce = cub::BlockReduce<double, kThreads>;
  __shared__ typename Reduce::TempStorage memory;
  return Reduce(memory).Sum(value);
}

}  // namespace esvr::cuda
