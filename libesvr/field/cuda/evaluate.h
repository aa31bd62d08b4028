#pragma once
/// evaluateBricksCuda on a stream that is there already.

#include <cuda_runtime_api.h>

#include <cstddef>
#include <span>

#include "esvr/ellipsoids.h"

namespace esvr::cuda {

/// \param stream      of the current device
/// \param batchBytes  bound on the device memory for bricks
void evaluateBricks(const Field& field, std::span<const Coord> corners, std::span<float> out,
                    cudaStream_t stream, std::size_t batchBytes);

}  // namespace esvr::cuda
