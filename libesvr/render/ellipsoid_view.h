#pragma once
/// Projects ellipsoids into a picture, and adds them to the samples of its rays. The code is
/// compiled for host and device. Projections are computed in float64, because a camera may be a
/// million voxels away.
///
/// In the frame u = S^-1 R^T (p - center) of an ellipsoid (docs/math.md), a ray is a line
/// u = o + tau v. Its parameter tau is the depth along the camera's forward direction. The
/// argument m = |u|^2 of the kernel is, along the ray,
///
///     m(tau) = |o x v|^2 / |v|^2 + |v|^2 (tau - closest)^2
///
/// with the parameter `closest` of the point nearest to the center. Both terms are positive, so
/// there is no cancellation. The vectors v ("along") and o x v ("beside") are linear functions of
/// the pixel's position. They are stored relative to the pixel whose ray goes through the
/// ellipsoid's center, where o x v is zero. Float32 is then precise enough for a camera at any
/// distance.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry.h"
#include "esvr/ellipsoids.h"
#include "esvr/field.h"
#include "render/view.h"

namespace esvr {

// The ellipsoids of a field.

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

/// The constants of a kernel in base 2: phi(m) = numerator / (plateau + 2^(m log2(e) - shift)) -
/// base for m < cutoff. KernelConstants (ellipsoids.h) has them in base e.
struct RayKernel {
  float numerator, plateau, shift, base, cutoff;
};

/// The ellipsoids of all chunks of a field in one array.
[[nodiscard]] std::vector<PackedEllipsoid> packed(const Field& field);
/// The origins of the chunks. Centers of ellipsoids are relative to them.
[[nodiscard]] std::vector<Vec3> chunkOrigins(const Field& field);
/// One kernel if all ellipsoids share it, otherwise one for each in the order of packed().
[[nodiscard]] std::vector<RayKernel> rayKernels(const Field& field);
/// A box around the supports of all ellipsoids; nothing if there are no ellipsoids.
[[nodiscard]] std::optional<PlaceBox> supportBox(const Field& field);

// Their outlines in a picture.

/// An ellipsoid in the coordinates of the view: right, up, forward.
struct SeenEllipsoid {
  Vec3 center;
  std::array<Vec3, 3> axes;  ///< of unit length in index space
  Vec3 scale;                ///< the scales along the axes
  /// The components of the steps View::right, up and forward along the axes: member a has those
  /// along axis a. If voxels are cubes, these are the coordinates of the axes.
  std::array<Vec3, 3> steps;
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

// Their form for rays.

/// An ellipsoid in the form that all rays of a picture use. dx and dy are the distance in pixels
/// from the reference pixel of its EllipsoidView.
struct RayForm {
  float along[3], alongX[3], alongY[3];     ///< v = along + dx alongX + dy alongY
  float beside[3], besideX[3], besideY[3];  ///< o x v = beside + dx besideX + dy besideY
  float offX, offY;      ///< change of u . v at `depth` for dx and dy, without the turn of the ray
  float gain, base;      ///< numerator and base of the kernel, times the intensity
  float plateau, shift;  ///< as in RayKernel
  float cutoff;          ///< as in RayKernel
};

/// A RayForm and its place in the picture.
struct alignas(16) EllipsoidView {
  double column, row;  ///< reference pixel, from which the dx and dy of `form` count
  double depth;        ///< tau of the point nearest to the center, on the ray of that pixel
  RayForm form;
};

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

/// The ellipsoids that at least one ray of the picture may meet, in the order of the field.
struct VisibleEllipsoids {
  std::vector<ScreenBounds> bounds;
  std::vector<EllipsoidView> views;
};
[[nodiscard]] VisibleEllipsoids visibleEllipsoids(const Field& field, const View& view,
                                                  Resolution resolution);

// Their values at samples: the innermost loop.

/// The number of samples per unit of tau on a pixel's ray.
struct RayScale {
  float unit;
  float pastTile;  ///< `unit` minus the value on the ray through the middle of the tile
};

/// The samples of a bin that lie in an ellipsoid's support: `first` to `last`, none if last <
/// first. At sample i the exponent in the kernel is, in base 2, nearest + speed (i - middle)^2.
struct RaySpan {
  int first, last;
  float middle, nearest, speed;
};

namespace ray_math {

inline constexpr float kLog2e = 1.44269504f;

ESVR_HD inline float squared(const float (&v)[3]) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}
ESVR_HD inline float clamped(float v, float low, float high) {
  return v < low ? low : (v > high ? high : v);
}

}  // namespace ray_math

/// \param depth        tau of the point nearest to the center, on the reference pixel's ray
/// \param middleAhead  number of samples from the bin's first one to the depth `depth`, on the ray
///                     through the middle of the tile
ESVR_HD inline RaySpan spanOn(const RayForm& f, float dx, float dy, const RayScale& ray,
                              float depth, float middleAhead) {
  using namespace ray_math;
  float turn[3], along[3], beside[3];
  for (int i = 0; i < 3; ++i) {
    turn[i] = dx * f.alongX[i] + dy * f.alongY[i];
    along[i] = f.along[i] + turn[i];
    beside[i] = f.beside[i] + dx * f.besideX[i] + dy * f.besideY[i];
  }
  const float along2 = squared(along), beside2 = squared(beside);
  if (!(beside2 < f.cutoff * along2)) return {0, -1, 0.0f, 0.0f, 0.0f};  // misses the support
  const float inverse = 1.0f / along2, nearest = beside2 * inverse;
  const float turned = turn[0] * along[0] + turn[1] * along[1] + turn[2] * along[2];
  const float later = -(f.offX * dx + f.offY * dy + depth * turned) * inverse;
  const float middle = middleAhead + depth * ray.pastTile + later * ray.unit;
  // Rounding may put `nearest` just beyond the cutoff.
  const float left = f.cutoff > nearest ? f.cutoff - nearest : 0.0f;
  const float half = std::sqrt(left * inverse) * ray.unit;
  const float first = std::ceil(clamped(middle - half, 0.0f, float(kBinSamples)));
  const float last = std::floor(clamped(middle + half, -1.0f, float(kBinSamples - 1)));
  return {int(first), int(last), middle, nearest * kLog2e - f.shift,
          along2 / (ray.unit * ray.unit) * kLog2e};
}

/// The value intensity * phi at a sample of the span.
ESVR_HD inline float valueAt(const RayForm& f, const RaySpan& span, int sample) {
  const float t = float(sample) - span.middle;
  return f.gain / (f.plateau + std::exp2(span.nearest + span.speed * t * t)) - f.base;
}

}  // namespace esvr
