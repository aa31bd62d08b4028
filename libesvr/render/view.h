#pragma once
/// A camera's coordinates, in which rays and bounds are computed: right, up and forward from the
/// eye. On the plane of the picture a place is (x, y): perspective, at distance 1 before the eye;
/// orthographic, in voxels.

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
  double left, top;  ///< of the picture in the plane

  /// Of the middle of a pixel.
  [[nodiscard]] double planeX(int column) const { return left + (column + 0.5) * pixel; }
  [[nodiscard]] double planeY(int row) const { return top - (row + 0.5) * pixel; }

  /// Of a direction or of a displacement from the eye.
  [[nodiscard]] Vec3 coordinates(const Vec3& v) const {
    return {inner(right, v), inner(up, v), inner(forward, v)};
  }
  [[nodiscard]] Ray ray(int column, int row) const {
    const Vec3 across = sum(scaled(right, planeX(column)), scaled(up, planeY(row)));
    if (perspective) return {eye, unit(sum(forward, across))};
    return {sum(eye, across), forward};
  }
};

}  // namespace esvr
