#pragma once
/// Rotations as quaternions and as matrices, in float64, for host and device.

#include <array>
#include <cmath>

#include "esvr/kernel.h"

namespace esvr {

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
