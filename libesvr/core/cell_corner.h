#pragma once
/// Numbers of the eight corners of a cell, which is the cube between eight neighbouring voxels. The
/// code is compiled for host and device.

#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

/// A corner has the number 4 x + 2 y + z, where x, y and z are 0 for the lowest corner and 1 for
/// those above it along the axis. A brick and its neighbours are numbered in the same way.
inline constexpr int kCellCorners = 8;

/// The step from the lowest corner to a corner.
[[nodiscard]] ESVR_HD inline Coord stepToCorner(int corner) {
  return {corner >> 2, (corner >> 1) & 1, corner & 1};
}
/// The number of the corner to which a step leads.
[[nodiscard]] ESVR_HD inline int cornerAt(Coord step) { return step.x << 2 | step.y << 1 | step.z; }

}  // namespace esvr
