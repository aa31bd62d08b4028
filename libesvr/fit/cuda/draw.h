#pragma once
/// Draws voxels in proportion to their squared residual (draw_voxels.h), on the device.

#include <cuda_runtime_api.h>

#include "esvr/coord.h"
#include "fit/cuda/growing_buffer.h"
#include "fit/draw_options.h"

namespace esvr::cuda {

class VoxelDraw {
 public:
  explicit VoxelDraw(cudaStream_t stream);

  /// \param residual  kBrickVoxels a brick; at least options.targetBricks of them
  /// \param loss      sum of r^2 over all bricks, finite
  /// \param bricks    coordinates of the bricks
  /// \return options.count voxels on the device; null where there is no error to mend
  [[nodiscard]] const Coord* draw(const float* residual, double loss, const Coord* bricks,
                                  const DrawOptions& options);

 private:
  cudaStream_t stream_;
  GrowingBuffer<std::uint64_t> energy_, sums_;
  GrowingBuffer<Coord> voxels_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
