#include "render/primitive_view.h"

#include <algorithm>
#include <limits>

#include "field/line_form.h"

namespace esvr {
namespace {

Vec3 times(const Matrix3& m, const Vec3& v) {
  return {inner({m[0], m[1], m[2]}, v), inner({m[3], m[4], m[5]}, v), inner({m[6], m[7], m[8]}, v)};
}
/// The transposed matrix times v.
Vec3 timesTransposed(const Matrix3& m, const Vec3& v) {
  return {inner({m[0], m[3], m[6]}, v), inner({m[1], m[4], m[7]}, v), inner({m[2], m[5], m[8]}, v)};
}

Vec3 centerOf(const Chunk& chunk, std::size_t i) {
  const auto& c = chunk.ellipsoids.center;
  return {double(c[0][i]) + chunk.origin.x, double(c[1][i]) + chunk.origin.y,
          double(c[2][i]) + chunk.origin.z};
}

double kappaOf(const Field& field, const Ellipsoids& e, std::size_t i) {
  return e.kappa.empty() ? double(field.kernel.kappa) : double(e.kappa[i]);
}

/// A support in the view's coordinates: center + F u, |u| < 1, by the rows of F.
struct ViewSupport {
  Vec3 center;
  std::array<Vec3, 3> rows;
};

ViewSupport supportIn(const View& view, const Vec3& fromEye, const Matrix3& L, double radius) {
  const Matrix3 F = inverse(L);
  const auto row = [&](const Vec3& axis) { return scaled(timesTransposed(F, axis), radius); };
  return {view.coordinates(fromEye), {row(view.right), row(view.up), row(view.forward)}};
}

struct Span {
  double low, high;
};

constexpr double kAll = std::numeric_limits<double>::infinity();

/// Of x / z over a support before the eye: the planes x = k z through the eye that touch it solve
/// (c_x - k c_z)^2 = |F_x - k F_z|^2. The discriminant is written so that nothing cancels for a
/// support that is small and far away.
Span perspectiveSpan(const ViewSupport& s, int axis) {
  const double cx = s.center[axis], cz = s.center[2];
  const Vec3 &fx = s.rows[axis], &fz = s.rows[2];
  const double a = cz * cz - inner(fz, fz), b = cx * cz - inner(fx, fz);
  const Vec3 mixed = difference(scaled(fx, cz), scaled(fz, cx)), normal = cross(fx, fz);
  const double root = std::sqrt(std::max(0.0, inner(mixed, mixed) - inner(normal, normal)));
  return {(b - root) / a, (b + root) / a};
}

Span orthographicSpan(const ViewSupport& s, int axis) {
  const double half = length(s.rows[axis]);
  return {s.center[axis] - half, s.center[axis] + half};
}

/// In the plane of the picture; everything where the support reaches the plane of the eye.
Span planeSpan(const View& view, const ViewSupport& s, int axis) {
  if (!view.perspective) return orthographicSpan(s, axis);
  return s.center[2] > length(s.rows[2]) ? perspectiveSpan(s, axis) : Span{-kAll, kAll};
}

/// Pixels whose middles lie in a span, and a little more for rounding.
struct Pixels {
  std::int32_t first, last;
};
Pixels pixelsWithin(double low, double high, int count) {
  constexpr double kSlack = 1e-3;
  const auto clamped = [&](double v) { return std::clamp(v, -1.0, double(count)); };
  return {std::max(0, std::int32_t(std::ceil(clamped(low - 0.5 - kSlack)))),
          std::min(count - 1, std::int32_t(std::floor(clamped(high - 0.5 + kSlack))))};
}

ScreenBounds screenBounds(const View& view, const ViewSupport& s, Resolution resolution) {
  const Span x = planeSpan(view, s, 0), y = planeSpan(view, s, 1);
  const Pixels columns = pixelsWithin((x.low - view.left) / view.pixel,
                                      (x.high - view.left) / view.pixel, resolution.width);
  const Pixels rows = pixelsWithin((view.top - y.high) / view.pixel,
                                   (view.top - y.low) / view.pixel, resolution.height);
  const double half = length(s.rows[2]);
  return {columns.first,     columns.last, rows.first, rows.last, std::max(0.0, s.center[2] - half),
          s.center[2] + half};
}

bool visible(const ScreenBounds& b) {
  return b.farthest >= 0.0 && b.firstColumn <= b.lastColumn && b.firstRow <= b.lastRow;
}

/// Perspective rays share their origin, eye, and run along forward + x right + y up; orthographic
/// ones run along forward from eye + x right + y up.
PrimitiveView primitiveView(const View& view, const Vec3& fromEye, const Matrix3& L) {
  const Vec3 eye = scaled(times(L, fromEye), -1.0), forward = times(L, view.forward);
  const Vec3 right = times(L, view.right), up = times(L, view.up), none{0.0, 0.0, 0.0};
  PrimitiveView p{};
  p.along = {forward, view.perspective ? right : none, view.perspective ? up : none};
  p.beside =
      view.perspective
          ? LinearInPlane<Vec3>{cross(eye, forward), cross(eye, right), cross(eye, up)}
          : LinearInPlane<Vec3>{cross(eye, forward), cross(right, forward), cross(up, forward)};
  const Vec3& other = view.perspective ? eye : forward;
  p.ahead = {inner(eye, forward), inner(other, right), inner(other, up)};
  return p;
}

void addChunk(const Field& field, const Chunk& chunk, const View& view, Resolution resolution,
              VisiblePrimitives& out) {
  const Ellipsoids& e = chunk.ellipsoids;
  for (std::size_t i = 0; i < e.size(); ++i) {
    const Matrix3 L = unitFrame(e, i);
    const Vec3 fromEye = difference(centerOf(chunk, i), view.eye);
    const auto kernel = kernelConstants<double>(field.kernel, kappaOf(field, e, i));
    const auto bounds =
        screenBounds(view, supportIn(view, fromEye, L, supportRadius(kernel)), resolution);
    if (!visible(bounds)) continue;
    out.bounds.push_back(bounds);
    PrimitiveView p = primitiveView(view, fromEye, L);
    p.kernel = kernelConstants<float>(field.kernel, kappaOf(field, e, i));
    p.intensity = e.intensity[i];
    out.views.push_back(p);
  }
}

}  // namespace

VisiblePrimitives visiblePrimitives(const Field& field, const View& view, Resolution resolution) {
  VisiblePrimitives visible;
  for (const Chunk& chunk : field.chunks) addChunk(field, chunk, view, resolution, visible);
  return visible;
}

}  // namespace esvr
