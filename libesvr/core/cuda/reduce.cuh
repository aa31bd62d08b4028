#pragma once
/// Reductions over the lanes of a warp and over the threads of a block. The order of each is fixed,
/// so that sums of floating-point numbers have the same bits in every run.

#include <cub/block/block_reduce.cuh>

#include "core/cuda/launch.h"

namespace esvr::cuda {

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

/// The largest value of a block. Every thread gets it, and the block can call it again at once.
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
