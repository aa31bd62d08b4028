#pragma once
/// Which ellipsoids are worth least.

#include <cuda_runtime_api.h>

#include "core/cuda/growing_buffer.h"
#include "fit/cuda/step.h"

namespace esvr::cuda {

class EllipsoidRanking {
 public:
  explicit EllipsoidRanking(cudaStream_t stream);

  struct Chosen {
    const std::uint32_t* places;  ///< on the device, the least useful first
    std::size_t count;
  };
  /// The `count` whose removal would raise the sum of squares least, of those that have taken
  /// graceSteps steps; fewer where there are fewer.
  [[nodiscard]] Chosen leastUseful(const StepArguments& fit, std::size_t count, int graceSteps);

 private:
  cudaStream_t stream_;
  GrowingBuffer<float> keys_, sortedKeys_;
  GrowingBuffer<std::uint32_t> places_, sortedPlaces_, settled_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
