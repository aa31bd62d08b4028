#pragma once
/// Samples voxels in proportion to their squared residual on the device, as fit/cpu/sample_voxels.h
/// does on the CPU.

#include <cuda_runtime_api.h>

#include "core/cuda/growing_buffer.h"
#include "esvr/coord.h"
#include "fit/sampling_options.h"

namespace esvr::cuda {

struct SamplingArguments;

struct DeviceSampling {
  const Coord* voxels = nullptr;  ///< distinct voxels, in device memory
  std::uint32_t count = 0;
  double share = 0.0;  ///< energy for each draw
};

class VoxelSampling {
 public:
  explicit VoxelSampling(cudaStream_t stream);

  /// \param residual  kBrickVoxels values for each brick; at least options.targetBricks bricks
  /// \param loss      sum of r^2 over all bricks; must be finite
  /// \param bricks    coordinates of the bricks
  /// \return no voxels if seeds cannot reduce any residual
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
