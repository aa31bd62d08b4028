#pragma once
/// The support of an ellipsoid, which is the region where its kernel is not 0, and the bricks that
/// it may touch.

#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/coord.h"
#include "esvr/sparse_volume.h"
#include "field/line_form.h"

namespace esvr {

struct Support {
  std::array<double, 3> center;  ///< voxels in the frame of the bricks
  Matrix3 L;
  double radius;               ///< radius in the unit frame
  double slack;                ///< voxels by which the support may move along every axis
  std::array<double, 3> half;  ///< half widths of the bounding box, including the slack
};

[[nodiscard]] ESVR_HD inline Support makeSupport(const std::array<double, 3>& center,
                                                 const Matrix3& L, double radius, double slack) {
  Support s{center, L, radius, slack, {}};
  const Matrix3 F = inverse(L);
  for (int a = 0; a < 3; ++a) s.half[a] = radius * std::sqrt(sigma(F, a, a)) + slack;
  return s;
}

/// The middle of a brick's voxels along an axis.
[[nodiscard]] ESVR_HD inline double middleOf(std::int32_t brick) {
  return double(brick) * kBrickSide + (kBrickSide - 1) / 2.0;
}

/// Largest distance, along row j of L, between the support's center and the middle of a brick that
/// may touch it.
[[nodiscard]] ESVR_HD inline double slabBound(const Support& s, int j) {
  constexpr double kHalf = (kBrickSide - 1) / 2.0;  // voxels are points, so a brick spans 7 voxels
  const double* row = &s.L[3 * j];
  const double reach = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
  return s.radius + (kHalf + s.slack) * reach;
}

/// Tests bricks against the planes that bound a support perpendicular to the rows of L, which are
/// its principal axes when L = S^-1 R^T. The support must outlive the test.
class SlabTest {
 public:
  ESVR_HD explicit SlabTest(const Support& support)
      : support_(support),
        bounds_{slabBound(support, 0), slabBound(support, 1), slabBound(support, 2)} {}

  /// \return false only where the brick's voxels certainly lie outside
  [[nodiscard]] ESVR_HD bool operator()(Coord brick) const {
    const double d[3] = {middleOf(brick.x) - support_.center[0],
                         middleOf(brick.y) - support_.center[1],
                         middleOf(brick.z) - support_.center[2]};
    for (int j = 0; j < 3; ++j) {
      const double* row = &support_.L[3 * j];
      const double u = row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
      if (std::abs(u) > bounds_[j]) return false;
    }
    return true;
  }

 private:
  const Support& support_;
  double bounds_[3];
};

/// The bricks that contain a voxel of a box, as a box of brick coordinates.
[[nodiscard]] constexpr Box bricksOf(const Box& voxels) {
  return {brickOf(voxels.min), brickOf(voxels.max)};
}

/// The brick that contains a position along an axis. Positions beyond the index space are clamped.
[[nodiscard]] ESVR_HD inline std::int32_t brickAlong(double place) {
  constexpr double kFirst = Box::kMin, kLast = Box::kMax;
  const double inside = place < kFirst ? kFirst : (place < kLast ? place : kLast);
  return std::int32_t(inside) >> kBrickLog2;
}

/// The bricks that overlap the bounding box, as a box of brick coordinates. It is cut off at the
/// ends of the index space, and is empty if the extent of the support is NaN.
[[nodiscard]] ESVR_HD inline Box brickRange(const Support& s) {
  std::int32_t low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    const double first = s.center[a] - s.half[a], last = s.center[a] + s.half[a];
    if (!(first <= last)) return {{0, 0, 0}, {-1, -1, -1}};
    low[a] = brickAlong(std::ceil(first));
    high[a] = brickAlong(std::floor(last));
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

}  // namespace esvr
