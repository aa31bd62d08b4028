#pragma once
/// Draws voxels in proportion to their squared residual (draw_voxels.h), on the device.

#include <cuda_runtime_api.h>

#include "core/cuda/growing_buffer.h"
#include "esvr/coord.h"
#include "fit/sampling_options.h"

namespace esvr::cuda {

struct SamplingArguments;

struct DeviceSampling {
  const Coord* voxels = nullptr;  ///< on the device, each once
  std::uint32_t count = 0;
  double share = 0.0;  ///< energy that each draw stood for
};

class VoxelSampling {
 public:
  explicit VoxelSampling(cudaStream_t stream);

  /// \param residual  kBrickVoxels a brick; at least options.targetBricks of them
  /// \param loss      sum of r^2 over all bricks, finite
  /// \param bricks    coordinates of the bricks
  /// \return none where there is no error to mend
  [[nodiscard]] DeviceSampling draw(const float* residual, double loss, const Coord* bricks,
                                    const SamplingOptions& options);

 private:
  [[nodiscard]] std::uint64_t sumEnergies(const SamplingArguments& arguments);
  [[nodiscard]] std::uint32_t keepEachOnce(std::uint32_t count);

  cudaStream_t stream_;
  GrowingBuffer<std::uint64_t> energy_, sums_;
  GrowingBuffer<Coord> drawn_, voxels_;
  GrowingBuffer<std::uint32_t> count_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
