#pragma once
/// The coordinates of a camera: right, up and forward, from the eye. Points of the picture have
/// coordinates (x, y) in the picture's plane: for a perspective camera it lies at a distance of 1
/// in front of the eye, and for an orthographic one x and y are in voxels. The struct holds plain
/// numbers, so that it can be copied to a device.

#include "esvr/camera.h"
#include "render/vector.h"

namespace esvr {

struct Ray {
  Vec3 origin, direction;  ///< the direction has unit length
};

struct View {
  View(const Camera& camera, Resolution resolution);

  Vec3 eye, right, up, forward;
  bool perspective;
  double pixel;      ///< side of a pixel in the picture's plane
  double left, top;  ///< edges of the picture in its plane

  /// x of the middle of a column of pixels. Columns may be fractions: 3.5 lies half-way between the
  /// middles of columns 3 and 4.
  [[nodiscard]] ESVR_HD double planeX(double column) const { return left + (column + 0.5) * pixel; }
  [[nodiscard]] ESVR_HD double planeY(double row) const { return top - (row + 0.5) * pixel; }
  /// The inverse of planeX; the result may be a fraction.
  [[nodiscard]] ESVR_HD double columnAt(double x) const { return (x - left) / pixel - 0.5; }
  [[nodiscard]] ESVR_HD double rowAt(double y) const { return (top - y) / pixel - 0.5; }

  /// Converts a direction, or a displacement from the eye, to the coordinates of the view.
  [[nodiscard]] ESVR_HD Vec3 coordinates(const Vec3& v) const {
    return {inner(right, v), inner(up, v), inner(forward, v)};
  }
  /// Length of the ray through (x, y) for one unit of depth along forward.
  [[nodiscard]] ESVR_HD double unitAlong(double x, double y) const {
    return perspective ? std::sqrt(1.0 + x * x + y * y) : 1.0;
  }
  /// Direction of the ray through (x, y), with a component of 1 along forward. Its length is
  /// unitAlong(x, y).
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
