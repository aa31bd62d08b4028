#pragma once
/// Sums the moments of each ellipsoid's pairs, chunk by chunk.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_pass.h"

namespace esvr::cuda {

/// Pointers are to device memory, borrowed.
struct MomentSums {
  PairListsView lists;
  std::uint32_t chunkCount;
  const float* moments;         ///< kMoments for each pair
  double* chunkSums;            ///< out: kMoments for each chunk
  const int* halted = nullptr;  ///< isHalted()
};

/// moment_sums.cuh adds up an ellipsoid's chunks afterwards.
void launchMomentSums(const MomentSums& sums, cudaStream_t stream);

}  // namespace esvr::cuda
