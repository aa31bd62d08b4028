#pragma once
/// The numbers by which evaluation on CUDA is tuned. The first decides on the rounding of results,
/// the others do not.

#include <cstddef>

#include "esvr/sparse_volume.h"

namespace esvr::cuda {

struct EvaluateTuning {
  /// A thread's voxels lie along y, where one closest approach serves them; 1, 2, 4 or 8. With two,
  /// a warp is a slice of the brick, and skips an ellipsoid that does not reach it.
  static constexpr int kVoxelsPerThread = 2;
  static constexpr int kThreads = kBrickVoxels / kVoxelsPerThread;
  /// Ellipsoids in shared memory at once; not more than threads, since each brings one.
  static constexpr int kStage = 64;
  /// Device memory for the bricks of one launch.
  static constexpr std::size_t kBatchBytes = std::size_t{256} << 20;
};
static_assert(EvaluateTuning::kStage <= EvaluateTuning::kThreads);
static_assert(kBrickSide % EvaluateTuning::kVoxelsPerThread == 0);

}  // namespace esvr::cuda
