#pragma once
/// Sums of floating-point numbers as integers, in units of a power of two. Integer sums do not
/// depend on the order of their terms, so that many threads can add to one of them.

#include <cmath>
#include <cstdint>

#include "esvr/ellipsoids.h"

namespace esvr::cuda {

struct SumLimits {
  int valueBits;  ///< a value is less than 2^(valueBits + 1) units
  int sumBits;    ///< a sum is less than 2^(sumBits + 1) units, apart from rounding
};

/// Two bits are left for the sign and for rounding, which adds up to half a unit for each value.
inline constexpr SumLimits kLimits32{29, 29}, kLimits64{61, 61};

/// A brick that more ellipsoids reach than this is summed in 64-bit integers. In 32 bits a list of
/// this length has units of 2^-17 of its largest intensity, and ordinary lists, of some 200 entries,
/// units of 2^-22.
inline constexpr std::uint32_t kMaxNarrowEntries = 4096;

/// \return e, such that a sum of `count` values of at most `largest` keeps the limits in units of
///         2^-e and both 2^e and 2^-e are normal numbers of float32
[[nodiscard]] ESVR_HD inline int unitExponent(float largest, std::uint32_t count,
                                              SumLimits limits) {
  constexpr int kMaxExponent = 126;
  if (!(largest > 0.0f) || count == 0) return 0;
  const int ofValue = limits.valueBits - std::ilogb(largest);
  const int ofSum = limits.sumBits - std::ilogb(largest * float(count));
  const int finest = ofValue < ofSum ? ofValue : ofSum;
  return finest < -kMaxExponent ? -kMaxExponent : (finest < kMaxExponent ? finest : kMaxExponent);
}

#if defined(__CUDACC__)
/// Adds a value in units, rounded to the nearest integer.
__device__ inline void addUnits(int& sum, float units) { atomicAdd(&sum, __float2int_rn(units)); }
__device__ inline void addUnits(long long& sum, float units) {
  atomicAdd(reinterpret_cast<unsigned long long*>(&sum),
            static_cast<unsigned long long>(__float2ll_rn(units)));
}
#endif

}  // namespace esvr::cuda
