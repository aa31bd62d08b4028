// Cameras: what is a valid one, its view of a volume, and the camera that shows a whole box.
#include "esvr/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "esvr/error.h"
#include "render/view.h"

namespace esvr {
namespace {

bool isNearlyCube(const VoxelShape& shape) {
  constexpr double kRounding = 1e-5;
  const VoxelShape cube;
  for (std::size_t a = 0; a < 3; ++a)
    if (length(difference(shape.edges[a], cube.edges[a])) > kRounding) return false;
  return true;
}

/// False if the edges are parallel to a plane to within rounding, or not finite.
bool hasVolume(const VoxelShape& shape) {
  constexpr double kFlat = 1e-12;  // share of the volume of a box with these edges
  const auto& [a, b, c] = shape.edges;
  const double ofBox = length(a) * length(b) * length(c);
  return std::isfinite(ofBox) && std::abs(inner(cross(a, b), c)) > kFlat * ofBox;
}

void requireFieldOfView(double degrees) {
  if (!(degrees > 0.0 && degrees < 180.0))
    throw UsageError("the field of view must be from 0 to 180 degrees");
}
}  // namespace

Vec3 VoxelShape::place(const Vec3& index) const {
  if (isCube()) return index;
  return sum(scaled(edges[0], index[0]),
             sum(scaled(edges[1], index[1]), scaled(edges[2], index[2])));
}

std::optional<VoxelShape> voxelShape(const std::optional<std::array<double, 16>>& affine) {
  if (!affine) return std::nullopt;
  const auto& m = *affine;
  VoxelShape shape;
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    shape.edges[a] = {m[4 * a], m[4 * a + 1], m[4 * a + 2]};
    shortest = std::min(shortest, length(shape.edges[a]));
  }
  if (!(shortest > 0.0) || !std::isfinite(shortest)) return std::nullopt;
  for (Vec3& edge : shape.edges) edge = scaled(edge, 1.0 / shortest);
  if (isNearlyCube(shape)) return VoxelShape{};
  return hasVolume(shape) ? std::optional(shape) : std::nullopt;
}
void checkCamera(const Camera& camera, Resolution resolution) {
  const auto finite = [](const Vec3& v) {
    return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
  };
  const auto require = [](bool good, const char* otherwise) {
    if (!good) throw UsageError(otherwise);
  };
  require(finite(camera.eye) && finite(camera.center) && finite(camera.up),
          "the camera has a place that is not finite");
  const Vec3 view = difference(camera.center, camera.eye);
  require(length(view) > 0.0, "the camera's eye is at the point it looks at");
  require(std::isfinite(length(view)),
          "the camera is too far away from the point that it looks at");
  require(hasVolume(camera.voxel), "the edges of a voxel have no volume");
  require(length(camera.up) > 0.0, "the camera's up has no length");
  require(std::isfinite(length(cross(unit(view), camera.up))), "the camera's up is too long");
  require(!parallel(unit(view), unit(camera.up)), "the camera looks along its up direction");
  requireFieldOfView(camera.fov);
  require(camera.height > 0.0 && std::isfinite(camera.height),
          "the height of an orthographic picture must be positive");
  require(resolution.width > 0 && resolution.height > 0, "a picture needs a pixel at least");
  require(std::max(resolution.width, resolution.height) <= Resolution::kMaxSide,
          "a picture may have 32767 pixels a side at most");
}

Camera turned(const Camera& camera, double degrees, const Vec3& pivot) {
  const Vec3 axis = unit(camera.up);
  const double c = std::cos(radians(degrees)), s = std::sin(radians(degrees));
  // Rodrigues' rotation formula.
  const auto moved = [&](const Vec3& place) {
    const Vec3 arm = difference(place, pivot);
    const Vec3 along = scaled(axis, inner(axis, arm) * (1.0 - c));
    return sum(pivot, sum(along, sum(scaled(arm, c), scaled(cross(axis, arm), s))));
  };
  Camera result = camera;
  result.eye = moved(camera.eye);
  result.center = moved(camera.center);
  return result;
}

// The view of a camera.

namespace {

/// A volume as a camera sees it, in the camera's space. Its place follows from the camera's center,
/// not from the eye, whose coordinates are too coarse if it is very far away.
struct FarVolume {
  FarVolume(const View& view, const Camera& camera, const PlaceBox& box)
      : exists(box.low[0] <= box.high[0]) {
    if (!exists) return;
    const Vec3 middle = camera.voxel.place(scaled(sum(box.low, box.high), 0.5));
    const Vec3 sides = difference(box.high, box.low);
    constexpr double kRoom = 1.0;  // so that no sample of the volume lies behind the first one
    radius = view.halfDiagonal * 2.0 * std::max({sides[0], sides[1], sides[2]}) + kRoom;
    const Vec3 fromCenter = difference(middle, camera.center);
    const double ahead = inner(view.forward, fromCenter);
    depth = length(difference(camera.center, camera.eye)) + ahead;
    onAxis = sum(camera.center, scaled(view.forward, ahead));
    fromEye = length(difference(middle, camera.eye));
    direction = view.forward, distance = depth;
    if (!view.perspective || !(depth > 0.0)) return;
    const double x = inner(view.right, fromCenter) / depth, y = inner(view.up, fromCenter) / depth;
    const Vec3 toMiddle = sum(view.forward, sum(scaled(view.right, x), scaled(view.up, y)));
    direction = unit(toMiddle), distance = depth * length(toMiddle);
  }

  [[nodiscard]] bool needsParallelRays(const View& view, double step) const {
    constexpr double kPrecise = 0x1p32;  // steps; samples then err by 1e-6 of a step
    /// Radii of the volume from which its front and its back differ in size by 2^-16, a quarter of
    /// a pixel at the edge of the largest picture.
    constexpr double kSameSize = 0x1p17;
    if (!exists || !(fromEye > kPrecise * std::min(step, 1.0)) || !(depth > radius)) return false;
    return !view.perspective || depth > kSameSize * radius;
  }

  bool exists;
  double radius = 0.0;    ///< of a sphere around the volume
  double depth = 0.0;     ///< of its middle along forward
  double fromEye = 0.0;   ///< distance of its middle
  double distance = 0.0;  ///< from the eye along `direction` to the plane of the middle
  Vec3 onAxis{};          ///< the point of the camera's axis at this depth
  Vec3 direction{};       ///< from the eye to the middle
};

}  // namespace

View::View(const Camera& camera, Resolution resolution)
    : View(camera, resolution, kNoPlaces, 1.0) {}

View::View(const Camera& camera, Resolution resolution, const PlaceBox& box, double step)
    : perspective(camera.projection == Projection::kPerspective) {
  setVoxel(camera.voxel);
  forward = unit(difference(camera.center, camera.eye));
  right = unit(cross(forward, camera.up));
  up = cross(right, forward);
  ofRight = right, ofUp = up, ofForward = forward;
  const double height = perspective ? 2.0 * std::tan(radians(camera.fov) / 2) : camera.height;
  pixel = height / resolution.height;
  left = -pixel * resolution.width / 2;
  top = pixel * resolution.height / 2;
  const FarVolume volume(*this, camera, box);
  if (!volume.needsParallelRays(*this, step)) {
    beginAt(camera.eye);
    return;
  }
  if (perspective) {
    // Ray (x, y) meets the plane through the volume's middle at (x, y) times the depth of that
    // plane.
    pixel *= volume.depth, left *= volume.depth, top *= volume.depth;
    forward = volume.direction;
    ofForward = scaled(ofForward, 1.0 / inner(ofForward, forward));
    ofRight = difference(right, scaled(ofForward, inner(right, forward)));
    ofUp = difference(up, scaled(ofForward, inner(up, forward)));
    perspective = false;
  }
  before = volume.distance - volume.radius;
  beginAt(difference(volume.onAxis, scaled(forward, volume.radius)));
}

void View::setVoxel(const VoxelShape& shape) {
  voxel = shape, isCube = shape.isCube();
  constexpr double kHalf = 0.5;
  for (int corner = 0; corner < 4; ++corner)
    halfDiagonal = std::max(
        halfDiagonal,
        length(shape.place({corner & 1 ? -kHalf : kHalf, corner & 2 ? -kHalf : kHalf, kHalf})));
  if (isCube) return;
  for (const Vec3& edge : shape.edges) longestEdge = std::max(longestEdge, length(edge));
}
/// Converts the axes, and the place where rays begin, from the camera's space to the index space.
void View::beginAt(const Vec3& place) {
  if (isCube) {
    eye = place;
    return;
  }
  const auto& [a, b, c] = voxel.edges;
  const double perVolume = 1.0 / inner(cross(a, b), c);
  const std::array rows{scaled(cross(b, c), perVolume), scaled(cross(c, a), perVolume),
                        scaled(cross(a, b), perVolume)};
  const auto toIndex = [&](const Vec3& v) {
    return Vec3{inner(rows[0], v), inner(rows[1], v), inner(rows[2], v)};
  };
  eye = toIndex(place);
  for (Vec3* axis : {&right, &up, &forward}) *axis = toIndex(*axis);
  for (Vec3* axis : {&ofRight, &ofUp, &ofForward})
    *axis = {inner(*axis, voxel.edges[0]), inner(*axis, voxel.edges[1]),
             inner(*axis, voxel.edges[2])};
}

// The camera that shows a box.

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
/// The camera of Framing::kSphere: the sphere around the box just fits into the shorter side of the
/// picture.
Camera aroundSphere(const Box& box, const CameraWish& wish, Resolution resolution) {
  constexpr double kHalfVoxel = 0.5;
  const double aspect = double(resolution.width) / resolution.height;
  const double radius = radiusOf(sides(box, kHalfVoxel), wish.voxel);
  Camera camera;
  camera.voxel = wish.voxel;
  camera.projection = wish.projection;
  camera.fov = wish.fov.value_or(camera.fov);
  requireFieldOfView(camera.fov);  // the place of the eye follows from it
  camera.height = wish.height.value_or(2.0 * radius / std::min(1.0, aspect));
  camera.center = pivotOf(box, wish);
  const double half = std::tan(radians(camera.fov) / 2);
  const double distance = radius / std::sin(std::atan(half * std::min(1.0, aspect)));
  const Vec3 direction = unit(wish.direction.value_or(kFromCenter));
  camera.eye = wish.eye.value_or(sum(camera.center, scaled(direction, distance)));
  // Up is the y axis, or the z axis if the camera looks along y.
  const Vec3 y{0.0, 1.0, 0.0}, z{0.0, 0.0, 1.0};
  const bool alongY = parallel(difference(camera.center, camera.eye), y);
  camera.up = wish.up.value_or(alongY ? z : y);
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
/// Fits a camera whose direction is right, and leaves the right edge of the picture free as wished.
Camera closer(const Box& box, Camera camera, const CameraWish& wish, Resolution resolution) {
  const bool perspective = camera.projection == Projection::kPerspective;
  if (!perspective) camera.height = 2.0;  // makes 1 the size of the picture
  Camera ofCubes = camera;                // its axes are those of the camera's space
  ofCubes.voxel = {};
  const View view(ofCubes, resolution);
  const Corners corners(box, camera, wish.framing == Framing::kTurn);
  const double room = 1.0 - wish.freeRight;
  const bool movable = !wish.center && !wish.eye;
  const Span ofColumns{scaled(view.right, -1.0 / view.left), -kFilledShare * room - wish.freeRight,
                       kFilledShare * room - wish.freeRight, movable};
  const Span ofRows{scaled(view.up, 1.0 / view.top), -kFilledShare, kFilledShare, movable};
  const Vec3 forward = perspective ? view.forward : Vec3{};
  const SpanFit columns(corners, ofColumns, forward), rows(corners, ofRows, forward);
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
