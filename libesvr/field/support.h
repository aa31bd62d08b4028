#pragma once
/// The support of an ellipsoid, which is the region where its kernel is not 0, and the bricks that
/// it may touch. All but the walk over these bricks is compiled for host and device.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "esvr/volume.h"
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

// The walk over the bricks that a support may touch, in increasing order. The time is proportional to
// their number and not to the volume of the bounding box, which can be a million times larger for a
// thin ellipsoid.

namespace brick_walk {

/// A range of bricks along an axis; empty if last < first.
struct Run {
  std::int32_t first, last;
};

/// The bricks of `run` whose middles lie between two positions, and one more at each end because of
/// rounding. A position that is NaN does not limit the range.
[[nodiscard]] inline Run between(double low, double high, Run run) {
  constexpr double kMiddle = (kBrickSide - 1) / 2.0;
  const double first = std::floor((low - kMiddle) / kBrickSide) - 1.0;
  const double last = std::ceil((high - kMiddle) / kBrickSide) + 1.0;
  if (first > double(run.last) || last < double(run.first)) return {run.first, run.first - 1};
  if (first > double(run.first)) run.first = std::int32_t(first);
  if (last < double(run.last)) run.last = std::int32_t(last);
  return run;
}

/// The slabs that SlabTest tests the middles of bricks against: |row . d| <= bound.
class Slabs {
 public:
  explicit Slabs(const Support& s) : support_(s) {
    Matrix3 unit;  // maps the intersection of the slabs to the cube |u_j| <= 1
    for (int j = 0; j < 3; ++j) {
      bounds_[j] = slabBound(s, j);
      for (int c = 0; c < 3; ++c) unit[3 * j + c] = s.L[3 * j + c] / bounds_[j];
    }
    const Matrix3 F = inverse(unit);
    const double xx = sigma(F, 0, 0);
    halfX_ = kAround * std::sqrt(xx);
    slope_ = sigma(F, 0, 1) / xx;
    halfY_ = kAround * line_form::conditionalSigmaY(columnOf(unit, 1), columnOf(unit, 2));
  }

  /// The range of bricks along y that may lie in the slabs, for bricks whose middles are at x. It
  /// is that of an ellipsoid around the intersection of the slabs.
  [[nodiscard]] Run rows(double x, Run all) const {
    const double dx = x - support_.center[0], t = dx / halfX_, left = 1.0 - t * t;
    const double half = halfY_ * std::sqrt(left < 0.0 ? 0.0 : left);
    const double middle = support_.center[1] + slope_ * dx;
    return between(middle - half, middle + half, all);
  }

  /// The range of bricks along z that lie in the slabs, for bricks whose middles are at x and y.
  [[nodiscard]] Run line(double x, double y, Run run) const {
    for (int j = 0; j < 3; ++j) {
      const double* row = &support_.L[3 * j];
      if (row[2] == 0.0) continue;
      const double u = row[0] * (x - support_.center[0]) + row[1] * (y - support_.center[1]);
      const double one = (-bounds_[j] - u) / row[2], other = (bounds_[j] - u) / row[2];
      run = between(support_.center[2] + std::min(one, other),
                    support_.center[2] + std::max(one, other), run);
    }
    return run;
  }

 private:
  static constexpr double kAround = 1.7320508075688774;  // half diagonal of the cube |u_j| <= 1

  const Support& support_;
  std::array<double, 3> bounds_;
  double halfX_, slope_, halfY_;
};

template <class Visit>
void visitBox(const SlabTest& mayTouch, const Box& range, Visit&& visit) {
  for (std::int32_t x = range.min.x; x <= range.max.x; ++x)
    for (std::int32_t y = range.min.y; y <= range.max.y; ++y)
      for (std::int32_t z = range.min.z; z <= range.max.z; ++z)
        if (const Coord brick{x, y, z}; mayTouch(brick)) visit(brick);
}

template <class Visit>
void visitLines(const Support& s, const Box& range, Visit&& visit) {
  const Slabs slabs(s);
  const SlabTest mayTouch(s);
  for (std::int32_t x = range.min.x; x <= range.max.x; ++x) {
    const Run rows = slabs.rows(middleOf(x), {range.min.y, range.max.y});
    for (std::int32_t y = rows.first; y <= rows.last; ++y) {
      const Run line = slabs.line(middleOf(x), middleOf(y), {range.min.z, range.max.z});
      visitBox(mayTouch, {{x, y, line.first}, {x, y, line.last}}, visit);
    }
  }
}

}  // namespace brick_walk

/// Calls visit(brick) for every brick that a support may touch.
/// \param within  box of brick coordinates; bricks outside are ignored
template <class Visit>
void forEachReachedBrick(const Support& s, const Box& within, Visit&& visit) {
  constexpr double kFewBricks = 512.0;  // a smaller box is searched faster without lines
  const Box range = common(brickRange(s), within);
  if (range.empty()) return;
  if (range.volume() <= kFewBricks)
    brick_walk::visitBox(SlabTest(s), range, visit);
  else
    brick_walk::visitLines(s, range, visit);
}

}  // namespace esvr
