#pragma once
/// Arithmetic on points and directions, for host and device.

#include <cmath>
#include <numbers>

#include "esvr/camera.h"
#include "esvr/coord.h"
#include "esvr/kernel.h"

namespace esvr {

ESVR_HD inline Vec3 pointOf(const Coord& c) { return {double(c.x), double(c.y), double(c.z)}; }
ESVR_HD inline Vec3 sum(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
ESVR_HD inline Vec3 difference(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
ESVR_HD inline Vec3 scaled(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
/// The dot product. field/line_form.h already has a function `dot`.
ESVR_HD inline double inner(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
ESVR_HD inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// The length, also if its square overflows.
inline double length(const Vec3& a) { return std::hypot(a[0], a[1], a[2]); }
inline Vec3 unit(const Vec3& a) { return scaled(a, 1.0 / length(a)); }
inline bool parallel(const Vec3& a, const Vec3& b) {
  constexpr double kSine = 1e-6;  // sine of the angle below which vectors count as parallel
  return length(cross(a, b)) <= kSine * length(a) * length(b);
}
inline double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

}  // namespace esvr
