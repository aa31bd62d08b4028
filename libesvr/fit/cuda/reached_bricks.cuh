#pragma once
/// The bricks that an ellipsoid reaches, a warp for each ellipsoid.

#include <cstdint>

#include "core/cuda/thread_number.cuh"
#include "fit/cuda/supports.h"

namespace esvr::cuda {

/// Calls visit(brick, reached) on all lanes together until every brick of `within` that is near a
/// support has been visited by one lane, lanes and rounds in increasing order of the bricks. The
/// support's bounding box must have fewer than 2^63 bricks in `within`: a fit bounds the scales of
/// its ellipsoids, and CudaIntensityPasses refuses fields that reach too far.
template <class Visit>
__device__ void visitReachedBricks(const Support& support, const Box& within, Visit&& visit) {
  const Box range = clippedRange(support, within);
  const auto nx = std::int64_t(range.max.x) - range.min.x + 1;
  const auto ny = std::int64_t(range.max.y) - range.min.y + 1;
  const auto nz = std::int64_t(range.max.z) - range.min.z + 1;
  const std::int64_t count = nx > 0 && ny > 0 && nz > 0 ? nx * ny * nz : 0;
  for (std::int64_t first = 0; first < count; first += kWarp) {
    const std::int64_t n = first + threadIdx.x % kWarp;
    const Coord brick{range.min.x + std::int32_t(n / (ny * nz)),
                      range.min.y + std::int32_t(n / nz % ny), range.min.z + std::int32_t(n % nz)};
    visit(brick, n < count && mayTouch(support, brick));
  }
}

}  // namespace esvr::cuda
