#pragma once
/// The sum of the ellipsoids over a brick, in integers in shared memory, by one block.

#include "core/cuda/integer_sum.cuh"
#include "core/cuda/reduce.cuh"
#include "fit/cuda/pair_lines.cuh"
#include "fit/cuda/pass_scene.h"

namespace esvr::cuda {

/// The entries of a brick in the lists.
struct BrickEntries {
  std::uint32_t begin, end;
  [[nodiscard]] __device__ std::uint32_t count() const { return end - begin; }
};

/// The brick that a block works on.
struct BlockBrick {
  std::uint32_t number;
  Coord corner;  ///< voxels
  BrickEntries entries;
};

__device__ inline BlockBrick blockBrick(const PassScene& scene) {
  const std::uint32_t brick = scene.lists.brickOrder[blockIdx.x];
  return {brick,
          scene.bricks[brick] * kBrickSide,
          {scene.lists.brickBegin[brick], scene.lists.brickBegin[brick + 1]}};
}

/// The integers that hold the sums of short lists, and those of long ones.
using NarrowSum = int;
using WideSum = long long;

template <class Sum>
inline constexpr bool kIsWide = sizeof(Sum) > sizeof(NarrowSum);

/// Whether a launch for this type of sums is to work on a brick.
template <class Sum>
__device__ inline bool isFor(const BrickEntries& entries) {
  return kIsWide<Sum> == (entries.count() > kMaxNarrowEntries);
}

/// Calls visit(entry) for the entries of a group of lanes.
template <int kThreads, class Visit>
__device__ inline void visitEntries(const BrickEntries& entries, Visit&& visit) {
  for (std::uint32_t k = entries.begin + threadIdx.x / kGroup; k < entries.end;
       k += kThreads / kGroup)
    visit(k);
}

/// The exponent of the units in which all ellipsoids of a list could have their maximum at one
/// voxel. Ends with a barrier.
/// \param height  height(entry): the entry's intensity
template <class Sum, int kThreads, class Height>
__device__ inline int sumExponent(const BrickEntries& entries, Height&& height) {
  float largest = 0.0f;
  for (std::uint32_t k = entries.begin + threadIdx.x; k < entries.end; k += kThreads)
    largest = fmaxf(largest, fabsf(height(k)));
  return unitExponent(blockMax<kThreads>(largest), entries.count(),
                      kIsWide<Sum> ? kLimits64 : kLimits32);
}

/// Sets the sums to 0, adds all entries, and ends with a barrier.
/// \param height  height(entry)
/// \param add     add(entry, units of 1): adds an entry's share of this lane to the sums
/// \return the size of a unit
template <class Sum, int kThreads, class Height, class Add>
__device__ inline float sumEntries(const BrickEntries& entries, Sum* sums, Height&& height,
                                   Add&& add) {
  for (int v = int(threadIdx.x); v < kPaddedVoxels; v += kThreads) sums[v] = 0;
  const int exponent = sumExponent<Sum, kThreads>(entries, height);  // the barrier after the zeros
  const float units = ldexpf(1.0f, exponent);
  visitEntries<kThreads>(entries, [&](std::uint32_t k) { add(k, units); });
  __syncthreads();
  return ldexpf(1.0f, -exponent);
}

/// Sums are replaced by values in the same memory.
template <class Sum>
__device__ inline void putValue(Sum& sum, float value) {
  sum = __float_as_int(value);
}
template <class Sum>
__device__ inline float valueIn(const Sum& sum) {
  return __int_as_float(int(sum));
}

}  // namespace esvr::cuda
