#pragma once
/// The target at positions between voxels, for a fit for drawing.

#include <cuda_runtime_api.h>

#include "fit/cuda/brick_table_view.h"
#include "fit/offset.h"

namespace esvr::cuda {

/// All pointers are to device memory that the caller owns.
struct OffsetTargetArguments {
  BrickTableView bricks;
  std::uint32_t brickCount;
  const float* values;  ///< kBrickVoxels values for each target brick
  /// Whether the nearest voxel of a brick replaces a voxel whose brick is not one of the target's.
  /// Otherwise such a voxel is 0.
  bool nearest;
  Offset offset;
  float* out;         ///< output: kBrickVoxels values for each of the brickCount bricks
  const int* halted;  ///< flag of isHalted()
};

/// Interpolates the target at the voxels of all bricks, moved by the offset.
void launchOffsetTarget(const OffsetTargetArguments& arguments, cudaStream_t stream);

}  // namespace esvr::cuda
