#pragma once
/// Computes the errors of a fit from its residuals.

#include <cuda_runtime_api.h>

#include "core/cuda/growing_buffer.h"
#include "esvr/sparse_volume.h"
#include "fit/optimiser.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct ErrorArguments {
  const float* residual;  ///< kBrickVoxels values for each brick
  const Coord* bricks;
  const BrickMask* active;  ///< active masks of the target bricks
  std::uint32_t brickCount, targetCount;
  Box box;
};

class ErrorSums {
 public:
  explicit ErrorSums(cudaStream_t stream);
  [[nodiscard]] FitErrors sum(const ErrorArguments& arguments);

 private:
  cudaStream_t stream_;
  GrowingBuffer<double> columns_, totals_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
