#include "esvr/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "esvr/error.h"
#include "render/vector.h"
#include "render/view.h"

namespace esvr {
namespace {

bool finite(const Vec3& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

void requireCamera(bool good, const char* otherwise) {
  if (!good) throw UsageError(otherwise);
}

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

/// Converts vectors of the camera's space to the index space.
class Inverse {
 public:
  explicit Inverse(const VoxelShape& shape) {
    const auto& [a, b, c] = shape.edges;
    const double perVolume = 1.0 / inner(cross(a, b), c);
    rows_ = {scaled(cross(b, c), perVolume), scaled(cross(c, a), perVolume),
             scaled(cross(a, b), perVolume)};
  }
  Vec3 operator()(const Vec3& v) const {
    return {inner(rows_[0], v), inner(rows_[1], v), inner(rows_[2], v)};
  }

 private:
  std::array<Vec3, 3> rows_;
};

/// A volume as a camera sees it, in the camera's space. Its place follows from the camera's center, not
/// from the eye, whose coordinates are too coarse if it is very far away.
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
    /// Radii of the volume from which its front and its back differ in size by 2^-16, a quarter of a
    /// pixel at the edge of the largest picture.
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

void checkCamera(const Camera& camera, Resolution resolution) {
  requireCamera(finite(camera.eye) && finite(camera.center) && finite(camera.up),
                "the camera has a place that is not finite");
  const Vec3 view = difference(camera.center, camera.eye);
  requireCamera(length(view) > 0.0, "the camera's eye is at the point it looks at");
  requireCamera(std::isfinite(length(view)),
                "the camera is too far away from the point that it looks at");
  requireCamera(hasVolume(camera.voxel), "the edges of a voxel have no volume");
  requireCamera(length(camera.up) > 0.0, "the camera's up has no length");
  requireCamera(std::isfinite(length(cross(unit(view), camera.up))), "the camera's up is too long");
  requireCamera(!parallel(unit(view), unit(camera.up)), "the camera looks along its up direction");
  requireCamera(camera.fov > 0.0 && camera.fov < 180.0,
                "the field of view must be from 0 to 180 degrees");
  requireCamera(camera.height > 0.0 && std::isfinite(camera.height),
                "the height of an orthographic picture must be positive");
  requireCamera(resolution.width > 0 && resolution.height > 0, "a picture needs a pixel at least");
  requireCamera(std::max(resolution.width, resolution.height) <= Resolution::kMaxSide,
                "a picture may have 32767 pixels a side at most");
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
  const Inverse toIndex(voxel);
  eye = toIndex(place);
  for (Vec3* axis : {&right, &up, &forward}) *axis = toIndex(*axis);
  for (Vec3* axis : {&ofRight, &ofUp, &ofForward})
    *axis = {inner(*axis, voxel.edges[0]), inner(*axis, voxel.edges[1]),
             inner(*axis, voxel.edges[2])};
}

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
    // Ray (x, y) meets the plane through the volume's middle at (x, y) times the depth of that plane.
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

}  // namespace esvr
