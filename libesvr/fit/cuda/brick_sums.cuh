#pragma once
/// Sums ellipsoids over the voxels of a brick. A block of threads adds integers in shared memory,
/// whose sum does not depend on the order of the terms.

#include "core/cuda/integer_sum.cuh"
#include "core/cuda/reduce.cuh"
#include "fit/cuda/pair_lines.cuh"
#include "fit/cuda/pass_scene.h"

namespace esvr::cuda {

/// The range of a brick's entries in the pair lists.
struct BrickEntries {
  std::uint32_t begin, end;
  [[nodiscard]] __device__ std::uint32_t count() const { return end - begin; }
};

/// The brick that a block works on.
struct BlockBrick {
  std::uint32_t number;
  Coord corner;  ///< lowest voxel
  BrickEntries entries;
};

__device__ inline BlockBrick blockBrick(const PassScene& scene) {
  const std::uint32_t brick = scene.lists.brickOrder[blockIdx.x];
  return {brick,
          scene.bricks[brick] * kBrickSide,
          {scene.lists.brickBegin[brick], scene.lists.brickBegin[brick + 1]}};
}

/// The integers for the sums of short lists and of long lists.
using NarrowSum = int;
using WideSum = long long;

template <class Sum>
inline constexpr bool kIsWide = sizeof(Sum) > sizeof(NarrowSum);

/// True if a brick's list has the length for which this type of sums is meant.
template <class Sum>
__device__ inline bool isFor(const BrickEntries& entries) {
  return kIsWide<Sum> == (entries.count() > kMaxNarrowEntries);
}

/// Calls visit(entry) for the entries that the calling group of lanes works on.
template <int kThreads, class Visit>
__device__ inline void visitEntries(const BrickEntries& entries, Visit&& visit) {
  for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
       k += kThreads / kGroup)
    visit(k);
}

/// The exponent of the unit of the sums. It is the finest one for which a sum cannot overflow, even
/// if all ellipsoids of the list have their maximum at one voxel. Ends with a barrier.
/// \param height  height(entry) returns the intensity of an entry
template <class Sum, int kThreads, class Height>
__device__ inline int sumExponent(const BrickEntries& entries, Height&& height) {
  float largest = 0.0f;
  for (std::uint32_t k = entries.begin + threadIdx.x; k < entries.end; k += kThreads)
    largest = fmaxf(largest, fabsf(height(k)));
  return unitExponent(blockMax<kThreads>(largest), entries.count(),
                      kIsWide<Sum> ? kLimits64 : kLimits32);
}

/// Sets the sums to 0, adds all entries, and ends with a barrier.
/// \param height  height(entry) returns the intensity of an entry
/// \param add     add(entry, units) adds the lane's share of an entry to the sums; `units` is the
///                number of units in 1.0
/// \return the size of a unit
template <class Sum, int kThreads, class Height, class Add>
__device__ inline float sumEntries(const BrickEntries& entries, Sum* sums, Height&& height,
                                   Add&& add) {
  for (int v = int(threadIdx.x); v < kPaddedVoxels; v += kThreads) sums[v] = 0;
  const int exponent = sumExponent<Sum, kThreads>(entries, height);  // has a barrier
  const float units = ldexpf(1.0f, exponent);
  visitEntries<kThreads>(entries, [&](std::uint32_t k) { add(k, units); });
  __syncthreads();
  return ldexpf(1.0f, -exponent);
}

/// Replaces a sum by a float in the same memory.
template <class Sum>
__device__ inline void putValue(Sum& sum, float value) {
  sum = __float_as_int(value);
}
template <class Sum>
__device__ inline float valueIn(const Sum& sum) {
  return __int_as_float(int(sum));
}

}  // namespace esvr::cuda
