#include <algorithm>
#include <limits>
#include <vector>

#include "esvr/camera.h"
#include "render/vector.h"
#include "render/view.h"

namespace esvr {
namespace {

constexpr Vec3 kFromCenter{0.5, 0.35, 1.0};  // default direction from the center to the eye

/// The middle of a box in the camera's space.
Vec3 middle(const Box& box, const VoxelShape& voxel) {
  return voxel.place({(double(box.min.x) + box.max.x) / 2, (double(box.min.y) + box.max.y) / 2,
                      (double(box.min.z) + box.max.z) / 2});
}

/// Lengths of the sides in voxels, if each voxel extends by `margin` to each side of its index.
Vec3 sides(const Box& box, double margin) {
  return {double(box.max.x) - box.min.x + 2 * margin, double(box.max.y) - box.min.y + 2 * margin,
          double(box.max.z) - box.min.z + 2 * margin};
}

/// Radius of the sphere around a box with these sides, in the camera's space.
double radiusOf(const Vec3& sides, const VoxelShape& voxel) {
  if (voxel.isCube()) return length(sides) / 2;
  double radius = 0.0;
  for (unsigned corner = 0; corner < 4; ++corner)
    radius = std::max(radius, length(voxel.place({corner & 1u ? -sides[0] : sides[0],
                                                  corner & 2u ? -sides[1] : sides[1], sides[2]})) /
                                  2);
  return radius;
}

/// Distance from the eye at which a sphere just fits into the shorter side of the picture.
double fittingDistance(double radius, double fov, double aspect) {
  const double half = std::tan(radians(fov) / 2);
  return radius / std::sin(std::atan(half * std::min(1.0, aspect)));
}

/// The y axis, or the z axis if the camera looks along y.
Vec3 defaultUp(const Camera& camera) {
  const Vec3 y{0.0, 1.0, 0.0}, z{0.0, 0.0, 1.0};
  return parallel(difference(camera.center, camera.eye), y) ? z : y;
}

/// The camera of Framing::kSphere.
Camera aroundSphere(const Box& box, const CameraWish& wish, Resolution resolution) {
  constexpr double kHalfVoxel = 0.5;
  const double aspect = double(resolution.width) / resolution.height;
  const double radius = radiusOf(sides(box, kHalfVoxel), wish.voxel);
  Camera camera;
  camera.voxel = wish.voxel;
  camera.projection = wish.projection;
  camera.fov = wish.fov.value_or(camera.fov);
  camera.height = wish.height.value_or(2.0 * radius / std::min(1.0, aspect));
  camera.center = pivotOf(box, wish);
  const double distance = fittingDistance(radius, camera.fov, aspect);
  const Vec3 direction = unit(wish.direction.value_or(kFromCenter));
  camera.eye = wish.eye.value_or(sum(camera.center, scaled(direction, distance)));
  camera.up = wish.up.value_or(defaultUp(camera));
  return camera;
}

/// The corners of a box relative to a camera's center. In a turn, each corner stands for the circle
/// on which it moves.
class Corners {
 public:
  Corners(const Box& box, const Camera& camera, bool turning)
      : axis_(unit(camera.up)), turning_(turning) {
    constexpr double kToNeighbour = 1.0;  // values are interpolated up to the next voxels
    const Vec3 half = scaled(sides(box, kToNeighbour), 0.5);
    const Vec3 from = difference(middle(box, camera.voxel), camera.center);
    for (unsigned corner = 0; corner < 8; ++corner)
      places_.push_back(sum(from, camera.voxel.place({corner & 1u ? half[0] : -half[0],
                                                      corner & 2u ? half[1] : -half[1],
                                                      corner & 4u ? half[2] : -half[2]})));
  }

  /// The largest inner product of a vector and a corner.
  [[nodiscard]] double reach(const Vec3& vector) const {
    double largest = -std::numeric_limits<double>::infinity();
    for (const Vec3& place : places_)
      largest = std::max(largest, turning_ ? turned(place, vector) : inner(place, vector));
    return largest;
  }

 private:
  /// The largest inner product of a vector and the points of a corner's circle. It is reached where
  /// the parts perpendicular to the axis point in the same direction.
  [[nodiscard]] double turned(const Vec3& place, const Vec3& vector) const {
    return inner(place, axis_) * inner(vector, axis_) +
           length(across(place)) * length(across(vector));
  }
  [[nodiscard]] Vec3 across(const Vec3& v) const {
    return difference(v, scaled(axis_, inner(v, axis_)));
  }

  std::vector<Vec3> places_;
  Vec3 axis_;
  bool turning_;
};

/// The columns or rows of a picture in which the box may be shown.
struct Span {
  Vec3 side;         ///< the inner product with this vector is 1 at the edge of the picture
  double low, high;  ///< -1 and 1 are the edges of the picture
  bool movable;      ///< whether the camera may move along `side`
};

/// Fits the corners between two planes through the eye. The size of the picture is the distance of
/// the eye for a perspective camera and half of the picture's height for an orthographic one. A
/// point p is inside the upper plane if inner(p, side) <= high * (size + inner(p, forward)), which
/// is linear in p; for an orthographic camera, `forward` is 0.
class SpanFit {
 public:
  SpanFit(const Corners& corners, const Span& span, const Vec3& forward)
      : span_(span),
        high_(corners.reach(difference(span.side, scaled(forward, span.high)))),
        low_(corners.reach(difference(scaled(forward, span.low), span.side))) {}

  /// The smallest size with which all corners are between the planes.
  [[nodiscard]] double size() const {
    if (span_.movable) return (high_ + low_) / (span_.high - span_.low);
    return std::max(high_ / span_.high, -low_ / span_.low);
  }
  /// The displacement of the camera that puts the corners as far from one plane as from the other.
  [[nodiscard]] Vec3 shift(double size) const {
    if (!span_.movable) return {};
    const double units = (high_ - low_ - (span_.high + span_.low) * size) / 2;
    return scaled(span_.side, units / inner(span_.side, span_.side));
  }

 private:
  Span span_;
  double high_, low_;
};

/// The rows and columns for a box that leaves the right edge free.
std::array<Span, 2> spansOf(const View& view, const CameraWish& wish) {
  const double room = 1.0 - wish.freeRight;
  const bool movable = !wish.center && !wish.eye;
  return {Span{scaled(view.right, -1.0 / view.left), -kFilledShare * room - wish.freeRight,
               kFilledShare * room - wish.freeRight, movable},
          Span{scaled(view.up, 1.0 / view.top), -kFilledShare, kFilledShare, movable}};
}

/// Fits a camera whose direction is right.
Camera closer(const Box& box, Camera camera, const CameraWish& wish, Resolution resolution) {
  const bool perspective = camera.projection == Projection::kPerspective;
  if (!perspective) camera.height = 2.0;  // makes 1 the size of the picture
  Camera ofCubes = camera;                // its axes are those of the camera's space
  ofCubes.voxel = {};
  const View view(ofCubes, resolution);
  const Corners corners(box, camera, wish.framing == Framing::kTurn);
  const auto spans = spansOf(view, wish);
  const Vec3 forward = perspective ? view.forward : Vec3{};
  const SpanFit columns(corners, spans[0], forward), rows(corners, spans[1], forward);
  const double size = std::max(columns.size(), rows.size());
  if (!perspective) camera.height = 2.0 * size;
  const double distance = perspective ? size : length(difference(camera.eye, camera.center));
  if (wish.eye) return camera;
  camera.center = sum(camera.center, sum(columns.shift(size), rows.shift(size)));
  camera.eye = difference(camera.center, scaled(view.forward, distance));
  return camera;
}

}  // namespace

Vec3 pivotOf(const Box& box, const CameraWish& wish) {
  return wish.center.value_or(middle(box, wish.voxel));
}

Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution) {
  const Camera camera = aroundSphere(box, wish, resolution);
  const bool given = camera.projection == Projection::kPerspective ? wish.eye.has_value()
                                                                   : wish.height.has_value();
  // A camera without a direction is refused by checkCamera.
  const bool aimless = parallel(difference(camera.center, camera.eye), camera.up);
  if (wish.framing == Framing::kSphere || given || aimless) return camera;
  return closer(box, camera, wish, resolution);
}

}  // namespace esvr
