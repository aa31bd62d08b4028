#pragma once
/// Visits the bricks that a support may touch, in increasing order. The time is proportional to
/// their number and not to the volume of the bounding box, which can be a million times larger for
/// a thin ellipsoid.

#include <algorithm>
#include <array>
#include <cmath>

#include "field/support.h"

namespace esvr {

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
