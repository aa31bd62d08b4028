#pragma once
/// Projects an ellipsoid into a picture: its outline, its range of depths, and its form for rays.
/// The code is compiled for host and device. It computes in float64, because a camera may be a
/// million voxels away.

#include <cstdint>

#include "core/rotation.h"
#include "render/ray_math.h"
#include "render/view.h"

namespace esvr {

/// The parameters of an ellipsoid in one record.
struct alignas(16) PackedEllipsoid {
  float center[3];  ///< relative to the origin of its chunk
  float intensity;
  float scale[3];
  std::uint32_t chunk;
  float rotation[4];  ///< w, x, y, z; need not have unit length
};
static_assert(sizeof(PackedEllipsoid) == 48);

ESVR_HD inline Matrix3 unitRotation(const PackedEllipsoid& e) {
  return rotationOf(normalised({double(e.rotation[0]), double(e.rotation[1]), double(e.rotation[2]),
                                double(e.rotation[3])}));
}

/// An ellipsoid in the coordinates of the view: right, up, forward.
struct SeenEllipsoid {
  Vec3 center;
  std::array<Vec3, 3> axes;  ///< of unit length in index space
  Vec3 scale;                ///< the scales along the axes
  /// The components of the steps View::right, up and forward along the axes: member a has those along
  /// axis a. If voxels are cubes, these are the coordinates of the axes.
  std::array<Vec3, 3> steps;
};

/// An ellipsoid in the form that rays use (ray_math.h).
struct alignas(16) EllipsoidView {
  double column, row;  ///< reference pixel, from which the dx and dy of `form` count
  double depth;        ///< tau of the point nearest to the center, on the ray of that pixel
  RayForm form;
};

/// The outline of a support in the picture, in pixels. It is an ellipse around (column, row): with
/// d = (c - column, r - row), a point (c, r) is inside if d^T [xx xy; xy yy]^-1 d < 1.
struct ScreenEllipse {
  double column, row;
  double xx, xy, yy;
  bool everywhere;  ///< the support reaches the plane of the eye, so it may cover every pixel
};

/// Bounds of a support in the picture. They may be slightly too large, but never too small.
struct ScreenBounds {
  std::int32_t firstColumn, lastColumn, firstRow, lastRow;  ///< pixels whose rays may meet it
  double nearest, farthest;                                 ///< depths along forward, at least 0
};

/// A range of columns. Whole numbers are the middles of pixels.
struct PixelSpan {
  double low, high;
};

namespace ellipsoid_math {

inline constexpr double kSlack = 1e-3;  ///< pixels that are added to bounds because of rounding

ESVR_HD inline Vec3 row(const std::array<Vec3, 3>& axes, const Vec3& lengths, int coordinate) {
  return {axes[0][coordinate] * lengths[0], axes[1][coordinate] * lengths[1],
          axes[2][coordinate] * lengths[2]};
}
ESVR_HD inline double atLeastZero(double v) { return v > 0.0 ? v : 0.0; }
ESVR_HD inline double lesser(double a, double b) { return b < a ? b : a; }
ESVR_HD inline double greater(double a, double b) { return a < b ? b : a; }
ESVR_HD inline double clampedTo(double v, double low, double high) {
  return greater(low, lesser(v, high));
}
ESVR_HD inline void store(const Vec3& from, double factor, float (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = float(from[i] * factor);
}

/// The rows of the matrix whose columns are the support's half axes. The length of a row is the
/// half extent of the support along that coordinate of the view.
struct HalfAxes {
  Vec3 x, y, z;
};
ESVR_HD inline HalfAxes halfAxes(const SeenEllipsoid& e, double radius) {
  const Vec3 lengths = scaled(e.scale, radius);
  return {row(e.axes, lengths, 0), row(e.axes, lengths, 1), row(e.axes, lengths, 2)};
}

/// The planes through the eye that touch the support form a conic; its dual conic is the outline.
/// The terms are arranged so that they do not cancel for a small support far away.
ESVR_HD inline ScreenEllipse perspectiveOutline(const View& view, const Vec3& c,
                                                const HalfAxes& f) {
  const double a = c[2] * c[2] - inner(f.z, f.z), s = 1.0 / (a * view.pixel);
  const Vec3 mixedX = scaled(difference(scaled(f.x, c[2]), scaled(f.z, c[0])), s);
  const Vec3 mixedY = scaled(difference(scaled(f.y, c[2]), scaled(f.z, c[1])), s);
  const Vec3 normalX = scaled(cross(f.x, f.z), s), normalY = scaled(cross(f.y, f.z), s);
  return {view.columnAt((c[0] * c[2] - inner(f.x, f.z)) / a),
          view.rowAt((c[1] * c[2] - inner(f.y, f.z)) / a),
          atLeastZero(inner(mixedX, mixedX) - inner(normalX, normalX)),
          -(inner(mixedX, mixedY) - inner(normalX, normalY)),  // rows count downwards
          atLeastZero(inner(mixedY, mixedY) - inner(normalY, normalY)),
          false};
}

ESVR_HD inline ScreenEllipse orthographicOutline(const View& view, const Vec3& c,
                                                 const HalfAxes& f) {
  const double s = 1.0 / (view.pixel * view.pixel);
  return {view.columnAt(c[0]),  view.rowAt(c[1]),    inner(f.x, f.x) * s,
          -inner(f.x, f.y) * s, inner(f.y, f.y) * s, false};
}

ESVR_HD inline std::int32_t firstPixel(double low, int count) {
  return std::int32_t(std::ceil(clampedTo(low - kSlack, 0.0, double(count))));
}
ESVR_HD inline std::int32_t lastPixel(double high, int count) {
  return std::int32_t(std::floor(clampedTo(high + kSlack, -1.0, double(count - 1))));
}

}  // namespace ellipsoid_math

/// The components of the view's steps along a direction of the index space.
ESVR_HD inline Vec3 stepsAlong(const View& view, const Vec3& axis) {
  return {inner(view.right, axis), inner(view.up, axis), inner(view.forward, axis)};
}

/// \param fromEye  displacement from the eye to the origin of the ellipsoid's chunk
ESVR_HD inline SeenEllipsoid seenBy(const View& view, const PackedEllipsoid& e,
                                    const Vec3& fromEye) {
  const Matrix3 R = unitRotation(e);
  const Vec3 center{double(e.center[0]), double(e.center[1]), double(e.center[2])};
  return {view.coordinates(sum(fromEye, center)),
          {view.coordinates(columnOf(R, 0)), view.coordinates(columnOf(R, 1)),
           view.coordinates(columnOf(R, 2))},
          {double(e.scale[0]), double(e.scale[1]), double(e.scale[2])},
          {stepsAlong(view, columnOf(R, 0)), stepsAlong(view, columnOf(R, 1)),
           stepsAlong(view, columnOf(R, 2))}};
}

/// \param radius  radius of the support in units of the scales
ESVR_HD inline ScreenEllipse outlineOf(const View& view, const SeenEllipsoid& e, double radius) {
  using namespace ellipsoid_math;
  const HalfAxes f = halfAxes(e, radius);
  if (!view.perspective) return orthographicOutline(view, e.center, f);
  if (!(e.center[2] > 0.0 && e.center[2] * e.center[2] > inner(f.z, f.z)))
    return {0.0, 0.0, 0.0, 0.0, 0.0, true};
  return perspectiveOutline(view, e.center, f);
}

ESVR_HD inline ScreenBounds boundsOf(const ScreenEllipse& o, const SeenEllipsoid& e, double radius,
                                     Resolution resolution) {
  using namespace ellipsoid_math;
  const Vec3 f = row(e.axes, scaled(e.scale, radius), 2);
  const double halfDepth = std::sqrt(inner(f, f));
  ScreenBounds b{0,
                 resolution.width - 1,
                 0,
                 resolution.height - 1,
                 atLeastZero(e.center[2] - halfDepth),
                 e.center[2] + halfDepth};
  if (o.everywhere) return b;
  const double halfWidth = std::sqrt(o.xx), halfHeight = std::sqrt(o.yy);
  b.firstColumn = firstPixel(o.column - halfWidth, resolution.width);
  b.lastColumn = lastPixel(o.column + halfWidth, resolution.width);
  b.firstRow = firstPixel(o.row - halfHeight, resolution.height);
  b.lastRow = lastPixel(o.row + halfHeight, resolution.height);
  return b;
}

ESVR_HD inline bool visible(const ScreenBounds& b) {
  return b.farthest >= 0.0 && b.firstColumn <= b.lastColumn && b.firstRow <= b.lastRow;
}

/// The part of the picture in which an ellipsoid is visible.
struct ScreenExtent {
  ScreenEllipse outline;
  ScreenBounds bounds;
};

/// \param radius  radius of the support in units of the scales
ESVR_HD inline ScreenExtent screenExtentOf(const View& view, const SeenEllipsoid& e, double radius,
                                           Resolution resolution) {
  const ScreenEllipse outline = outlineOf(view, e, radius);
  return {outline, boundsOf(outline, e, radius, resolution)};
}

/// The columns that an outline covers between two rows; low > high if it covers none. The result is
/// exact up to kSlack: the leftmost point is where the outline is vertical, or, if that is outside
/// the rows, on the row nearest to it. The same holds for the rightmost point.
ESVR_HD inline PixelSpan columnsBetween(const ScreenEllipse& o, double firstRow, double lastRow) {
  using namespace ellipsoid_math;
  const double halfHeight = std::sqrt(o.yy);
  const double top = greater(firstRow - kSlack - o.row, -halfHeight);
  const double bottom = lesser(lastRow + kSlack - o.row, halfHeight);
  if (!(top <= bottom)) return {1.0, -1.0};
  if (!(o.yy > 0.0)) return {o.column - std::sqrt(o.xx), o.column + std::sqrt(o.xx)};
  const double slope = o.xy / o.yy, reach = atLeastZero(o.xx - o.xy * slope);
  const auto half = [&](double y) { return std::sqrt(reach * atLeastZero(1.0 - y * y / o.yy)); };
  const double extreme = o.xx > 0.0 ? o.xy / std::sqrt(o.xx) : 0.0;
  const double right = clampedTo(extreme, top, bottom), left = clampedTo(-extreme, top, bottom);
  return {o.column + slope * left - half(left), o.column + slope * right + half(right)};
}

/// The form of an ellipsoid for rays. Perspective rays begin at the eye and run along
/// forward + x right + y up; orthographic rays begin at eye + x right + y up and run along forward.
/// The reference pixel is where the ray through the ellipsoid's center meets the picture. If the
/// support reaches the plane of the eye, that ray may point backwards, and the reference pixel is
/// the middle of the picture.
ESVR_HD inline EllipsoidView viewOf(const View& view, const SeenEllipsoid& e, bool reachesEye,
                                    float intensity, const RayKernel& kernel) {
  using namespace ellipsoid_math;
  const Vec3 inverse{1.0 / e.scale[0], 1.0 / e.scale[1], 1.0 / e.scale[2]};
  const Vec3 right = row(e.steps, inverse, 0), up = row(e.steps, inverse, 1),
             forward = row(e.steps, inverse, 2), none{0.0, 0.0, 0.0};
  const Vec3 eye = scaled(
      sum(sum(scaled(right, e.center[0]), scaled(up, e.center[1])), scaled(forward, e.center[2])),
      -1.0);
  const bool centered = !view.perspective || !reachesEye;
  const double z = e.center[2];
  const double x0 = !centered ? 0.0 : (view.perspective ? e.center[0] / z : e.center[0]);
  const double y0 = !centered ? 0.0 : (view.perspective ? e.center[1] / z : e.center[1]);
  const Vec3 along = view.perspective && centered ? scaled(eye, -1.0 / z) : forward;
  const Vec3 alongX = view.perspective ? right : none, alongY = view.perspective ? up : none;
  const Vec3 besideX = view.perspective ? cross(eye, right) : cross(right, forward);
  const Vec3 besideY = view.perspective ? cross(eye, up) : cross(up, forward);
  const double depth = centered ? z : -inner(eye, forward) / inner(forward, forward);
  const Vec3 closest = centered ? none : sum(eye, scaled(forward, depth));
  const double dx = view.pixel, dy = -view.pixel;  // steps to the next column and the next row

  EllipsoidView p;
  p.column = view.columnAt(x0), p.row = view.rowAt(y0), p.depth = depth;
  store(along, 1.0, p.form.along);
  store(alongX, dx, p.form.alongX);
  store(alongY, dy, p.form.alongY);
  store(centered ? none : cross(eye, forward), 1.0, p.form.beside);
  store(besideX, dx, p.form.besideX);
  store(besideY, dy, p.form.besideY);
  p.form.offX = float(dx * (view.perspective ? inner(closest, right) : inner(right, forward)));
  p.form.offY = float(dy * (view.perspective ? inner(closest, up) : inner(up, forward)));
  p.form.gain = intensity * kernel.numerator, p.form.base = intensity * kernel.base;
  p.form.plateau = kernel.plateau, p.form.shift = kernel.shift, p.form.cutoff = kernel.cutoff;
  return p;
}

/// The range, over the rays of a rectangle of pixels, of the length of ray for one unit of depth
/// along forward.
struct UnitRange {
  double min, max;
};
ESVR_HD inline UnitRange unitRange(const View& view, int firstColumn, int lastColumn, int firstRow,
                                   int lastRow) {
  using namespace ellipsoid_math;
  if (!view.perspective) return {1.0, 1.0};
  const double x0 = view.planeX(firstColumn), x1 = view.planeX(lastColumn);
  const double y0 = view.planeY(lastRow), y1 = view.planeY(firstRow);
  return {view.unitAlong(clampedTo(0.0, x0, x1), clampedTo(0.0, y0, y1)),
          view.unitAlong(greater(-x0, x1), greater(-y0, y1))};
}

/// The bins that samples in a support may lie in, counted from the eye.
struct BinRange {
  std::int64_t first, last;
};
ESVR_HD inline BinRange binsOf(const ScreenBounds& b, const UnitRange& unit, double step) {
  using ellipsoid_math::clampedTo;
  constexpr double kRounding = 1e-6;   // bins; a bound may lie exactly on a sample
  constexpr double kLastBin = 0x1p52;  // keeps the conversion to integers within their range
  const double binLength = step * kBinSamples;
  const double first = std::floor(b.nearest * unit.min / binLength - kRounding);
  const double last = std::floor(b.farthest * unit.max / binLength + kRounding);
  return {std::int64_t(clampedTo(first, 0.0, kLastBin)),
          std::int64_t(clampedTo(last, -1.0, kLastBin))};
}

}  // namespace esvr
