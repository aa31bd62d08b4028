#pragma once
/// Sums the moments of each ellipsoid's pairs, chunk by chunk.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_pass.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct MomentSums {
  PairListsView lists;
  std::uint32_t chunkCount;
  const float* moments;         ///< kMoments values for each pair
  double* chunkSums;            ///< output: kMoments values for each chunk
  const int* halted = nullptr;  ///< flag of isHalted()
};

/// Sums the chunks. sumsOf() (moment_sums.cuh) adds up the chunks of an ellipsoid afterwards.
void launchMomentSums(const MomentSums& sums, cudaStream_t stream);

}  // namespace esvr::cuda
