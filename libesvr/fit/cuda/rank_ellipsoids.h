#pragma once
/// Finds the ellipsoids whose removal adds the smallest error.

#include <cuda_runtime_api.h>

#include "core/cuda/growing_buffer.h"
#include "fit/cuda/step.h"

namespace esvr::cuda {

class EllipsoidRanking {
 public:
  explicit EllipsoidRanking(cudaStream_t stream);

  struct Chosen {
    const std::uint32_t* places;  ///< in device memory; the least useful ellipsoid first
    std::size_t count;
  };
  /// The `count` ellipsoids whose removal adds the smallest error. Only ellipsoids that have
  /// taken graceSteps steps are chosen, so the result may be shorter.
  [[nodiscard]] Chosen leastUseful(const StepArguments& fit, std::size_t count, int graceSteps);

 private:
  cudaStream_t stream_;
  GrowingBuffer<float> keys_, sortedKeys_;
  GrowingBuffer<std::uint32_t> places_, sortedPlaces_, settled_;
  GrowingBuffer<char> temporary_;
};

}  // namespace esvr::cuda
