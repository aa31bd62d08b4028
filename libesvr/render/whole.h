#pragma once
/// Rounds floats to integers, on host and device. Conversion instructions are slow on a device.
/// There, 1.5 * 2^23 is added instead, which leaves the rounded number in the lowest bits of the
/// float. The magnitude of the floats must be below 2^22.

#include <cmath>

#include "esvr/kernel.h"

namespace esvr {

namespace whole_numbers {
inline constexpr float kShift = 12582912.0f;  ///< 1.5 * 2^23
}

/// floor(v), and the fraction v - floor(v).
struct WholePart {
  int whole;
  float left;
};
ESVR_HD inline WholePart wholePart(float v) {
#if defined(__CUDA_ARCH__)
  const float shifted = __fadd_rd(v, whole_numbers::kShift);
  return {__float_as_int(shifted) - __float_as_int(whole_numbers::kShift),
          v - (shifted - whole_numbers::kShift)};
#else
  const float below = std::floor(v);
  return {int(below), v - below};
#endif
}
ESVR_HD inline int wholeBelow(float v) { return wholePart(v).whole; }

/// ceil(v)
ESVR_HD inline int wholeAbove(float v) {
#if defined(__CUDA_ARCH__)
  return __float_as_int(__fadd_ru(v, whole_numbers::kShift)) -
         __float_as_int(whole_numbers::kShift);
#else
  return int(std::ceil(v));
#endif
}

ESVR_HD inline int wholeNearest(float v) {
#if defined(__CUDA_ARCH__)
  return __float_as_int(v + whole_numbers::kShift) - __float_as_int(whole_numbers::kShift);
#else
  return int(std::nearbyint(v));
#endif
}

/// The integers from `first` to `last`; none if last < first.
struct WholeRange {
  int first, last;
};
/// The integers from low to high that also lie in `others`.
ESVR_HD inline WholeRange wholeWithin(float low, float high, WholeRange others) {
  const float first = float(others.first), last = float(others.last);
  const float from = low < first ? first : (low > last ? last + 1.0f : low);
  const float to = high > last ? last : (high < first ? first - 1.0f : high);
  return {wholeAbove(from), wholeBelow(to)};
}

}  // namespace esvr
