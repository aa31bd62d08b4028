#pragma once
/// The values of a target between its voxels, by trilinear interpolation.

#include <array>
#include <span>

#include "fit/offset.h"

namespace esvr {

/// The values of the bricks that an interpolation reads (offset.h). A null pointer stands for a
/// brick that the target does not have.
using InterpolatedBricks = std::array<const float*, kInterpolatedBricks>;

/// The value of a voxel that is missing because the target does not have its brick.
enum class Missing {
  kZero,    ///< the background
  kNearest  ///< the nearest voxel of the brick itself, for a narrow band, which ends at its bricks
};

/// Interpolates at the voxels of a brick, moved by the offset.
/// \param out  kBrickVoxels values
void interpolateBrick(const InterpolatedBricks& around, const Offset& offset, Missing missing,
                      std::span<float> out);

}  // namespace esvr
