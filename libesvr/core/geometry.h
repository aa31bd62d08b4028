#pragma once
/// Numbers of axes and of the corners of a cell, and rotations in float64. The code is compiled for host
/// and device.

#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/ellipsoids.h"
#include "esvr/volume.h"

namespace esvr {

/// The components of a coordinate by number: 0 is x, 1 is y, 2 is z.
using CoordAxis = std::int32_t Coord::*;
inline constexpr CoordAxis kAxes[] = {&Coord::x, &Coord::y, &Coord::z};

/// A cell is the cube between eight neighbouring voxels. A corner has the number 4 x + 2 y + z, where x, y
/// and z are 0 for the lowest corner and 1 for those above it along the axis. A brick and its neighbours
/// are numbered in the same way.
inline constexpr int kCellCorners = 8;

/// The step from the lowest corner to a corner.
[[nodiscard]] ESVR_HD inline Coord stepToCorner(int corner) {
  return {corner >> 2, (corner >> 1) & 1, corner & 1};
}
/// The number of the corner to which a step leads.
[[nodiscard]] ESVR_HD inline int cornerAt(Coord step) { return step.x << 2 | step.y << 1 | step.z; }

/// A 3x3 matrix, row by row.
using Matrix3 = std::array<double, 9>;

/// The components w, x, y, z.
using Quaternion = std::array<double, 4>;

ESVR_HD inline double lengthOf(const Quaternion& q) {
  return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

ESVR_HD inline Quaternion normalised(const Quaternion& q) {
  const double s = 1.0 / lengthOf(q);
  return {q[0] * s, q[1] * s, q[2] * s, q[3] * s};
}

/// The matrix of a rotation, whose columns are the rotated axes.
/// \param q  a quaternion of unit length
ESVR_HD inline Matrix3 rotationOf(const Quaternion& q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

ESVR_HD inline std::array<double, 3> columnOf(const Matrix3& m, int c) {
  return {m[c], m[3 + c], m[6 + c]};
}

}  // namespace esvr
