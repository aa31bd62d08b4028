#pragma once
/// Device functions that the kernels of a step share.

#include "fit/cuda/moment_sums.h"
#include "fit/parameter_gradient.h"

namespace esvr::cuda {

/// \return the moments of ellipsoid i. launchMomentSums must have been called before.
__device__ inline PairSums sumsOf(const MomentSums& a, std::uint32_t i) {
  PairSums s{};
  for (std::uint32_t c = a.lists.chunkBegin[i]; c < a.lists.chunkBegin[i + 1]; ++c) {
    const double* const m = a.chunkSums + std::size_t(c) * kMoments;
    s.w0x += m[0], s.w0z += m[1], s.w0xx += m[2], s.w0xz += m[3], s.w0zz += m[4];
    s.w1 += m[5], s.w1x += m[6], s.w1z += m[7], s.w2 += m[8], s.rPhi += m[9], s.phi2 += m[10];
    s.rEdge += m[11];
  }
  return s;
}

/// False if a parameter is not finite. The sum over all parameters is finite only if all are.
__device__ inline bool finite(const Ellipsoid& p) {
  double sum = p.intensity;
  for (const double c : p.center) sum += c;
  for (const double l : p.L) sum += l;
  return isfinite(sum);
}

}  // namespace esvr::cuda
