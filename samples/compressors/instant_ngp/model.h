#pragma once
/// Instant-NGP as a model of a volume: a hash grid and a small network, by tiny-cuda-nn.

#include "volume.h"

namespace ngp {

struct TrainOptions {
  std::uint64_t bytes = 0;     ///< largest size of the file
  std::uint32_t steps = 8000;  ///< of 2^18 voxels each
};

/// Fits a model to an array. The largest hash grid whose file is not larger than wanted is taken;
/// the network is smaller where it would take more than a quarter of the file.
/// \throws std::runtime_error  no model is so small, or CUDA reports an error
[[nodiscard]] Stored train(const std::vector<float>& voxels, const Sides& sides,
                           const TrainOptions& options);

/// Evaluates a model at the centers of all voxels.
/// \throws std::runtime_error  the number of parameters is not that of the shape, or CUDA reports
///                             an error
[[nodiscard]] std::vector<float> evaluate(const Stored& model);

}  // namespace ngp
