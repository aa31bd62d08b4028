#pragma once
/// A camera's coordinates, in which rays and bounds are computed: right, up and forward from the
/// eye. On the plane of the picture a place is (x, y): perspective, at distance 1 before the eye;
/// orthographic, in voxels. Plain numbers, so that it travels to a device as it is.

#include "esvr/camera.h"
#include "render/vector.h"

namespace esvr {

struct Ray {
  Vec3 origin, direction;  ///< direction of unit length
};

struct View {
  View(const Camera& camera, Resolution resolution);

  Vec3 eye, right, up, forward;
  bool perspective;
  double pixel;      ///< side of a pixel in the plane
  double left, top;  ///< the picture's edges in the plane

  /// The place of a pixel's middle; pixel 3.5 is half-way from the third to the fourth.
  [[nodiscard]] ESVR_HD double planeX(double column) const { return left + (column + 0.5) * pixel; }
  [[nodiscard]] ESVR_HD double planeY(double row) const { return top - (row + 0.5) * pixel; }
  /// The pixel whose middle lies at a place in the plane, with its fraction.
  [[nodiscard]] ESVR_HD double columnAt(double x) const { return (x - left) / pixel - 0.5; }
  [[nodiscard]] ESVR_HD double rowAt(double y) const { return (top - y) / pixel - 0.5; }

  /// The coordinates of a direction or of a displacement from the eye.
  [[nodiscard]] ESVR_HD Vec3 coordinates(const Vec3& v) const {
    return {inner(right, v), inner(up, v), inner(forward, v)};
  }
  /// How far one unit along forward is on the ray of a place.
  [[nodiscard]] ESVR_HD double unitAlong(double x, double y) const {
    return perspective ? std::sqrt(1.0 + x * x + y * y) : 1.0;
  }
  /// Perspective: its length is unitAlong.
  [[nodiscard]] ESVR_HD Vec3 directionAt(double x, double y) const {
    return perspective ? sum(forward, sum(scaled(right, x), scaled(up, y))) : forward;
  }
  [[nodiscard]] ESVR_HD Ray ray(double column, double row) const {
    const double x = planeX(column), y = planeY(row);
    if (perspective) return {eye, scaled(directionAt(x, y), 1.0 / unitAlong(x, y))};
    return {sum(eye, sum(scaled(right, x), scaled(up, y))), forward};
  }
};

}  // namespace esvr
