#pragma once
/// The region an ellipsoid reaches, and the bricks that it may touch.

#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"
#include "field/line_form.h"

namespace esvr {

struct Support {
  std::array<double, 3> center;  ///< voxels, in the frame of the bricks
  Matrix3 L;
  double radius;               ///< in the unit frame
  double slack;                ///< voxels that every face is moved outwards
  std::array<double, 3> half;  ///< half widths of the bounding box, slack included
};

[[nodiscard]] ESVR_HD inline Support makeSupport(const std::array<double, 3>& center,
                                                 const Matrix3& L, double radius, double slack) {
  Support s{center, L, radius, slack, {}};
  const Matrix3 F = inverse(L);
  for (int a = 0; a < 3; ++a) s.half[a] = radius * std::sqrt(sigma(F, a, a)) + slack;
  return s;
}

/// False only where the brick's voxels certainly lie outside: tests the planes that bound the
/// support perpendicular to the rows of L, which are its principal axes when L = S^-1 R^T.
[[nodiscard]] ESVR_HD inline bool mayTouch(const Support& s, Coord brick) {
  constexpr double kHalf = (kBrickSide - 1) / 2.0;  // voxels are points: a brick spans 7, not 8
  const double d[3] = {double(brick.x) * kBrickSide + kHalf - s.center[0],
                       double(brick.y) * kBrickSide + kHalf - s.center[1],
                       double(brick.z) * kBrickSide + kHalf - s.center[2]};
  for (int j = 0; j < 3; ++j) {
    const double* row = &s.L[3 * j];
    const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
    const double reach = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
    const double length2 = row[0] * row[0] + row[1] * row[1] + row[2] * row[2];
    const double bound = s.radius + kHalf * reach + s.slack * std::sqrt(length2);
    if (std::abs(u) > bound) return false;
  }
  return true;
}

/// Bricks that overlap the bounding box, as a box of brick coordinates.
[[nodiscard]] ESVR_HD inline Box brickRange(const Support& s) {
  const auto low = [&](int a) {
    return std::int32_t(std::ceil(s.center[a] - s.half[a])) >> kBrickLog2;
  };
  const auto high = [&](int a) {
    return std::int32_t(std::floor(s.center[a] + s.half[a])) >> kBrickLog2;
  };
  return {{low(0), low(1), low(2)}, {high(0), high(1), high(2)}};
}

template <class Visit>
void forEachReachedBrick(const Support& s, Visit&& visit) {
  const Box range = brickRange(s);
  for (std::int32_t x = range.min.x; x <= range.max.x; ++x)
    for (std::int32_t y = range.min.y; y <= range.max.y; ++y)
      for (std::int32_t z = range.min.z; z <= range.max.z; ++z)
        if (const Coord brick{x, y, z}; mayTouch(s, brick)) visit(brick);
}

}  // namespace esvr
