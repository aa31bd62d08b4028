#include "esvr/camera.h"

#include <algorithm>
#include <numbers>

#include "esvr/error.h"
#include "render/vector.h"
#include "render/view.h"

namespace esvr {
namespace {

constexpr Vec3 kFromCenter{0.5, 0.35, 1.0};  // default direction from the center to the eye
constexpr double kParallel = 1e-6;           // sine of the angle below which vectors are parallel

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

Vec3 middle(const Box& box) {
  return {(double(box.min.x) + box.max.x) / 2, (double(box.min.y) + box.max.y) / 2,
          (double(box.min.z) + box.max.z) / 2};
}

/// Radius of the sphere around a box. A voxel extends half a voxel to each side of its index.
double boundingRadius(const Box& box) {
  return length({double(box.max.x) - box.min.x + 1, double(box.max.y) - box.min.y + 1,
                 double(box.max.z) - box.min.z + 1}) /
         2;
}

bool parallel(const Vec3& a, const Vec3& b) {
  return length(cross(a, b)) <= kParallel * length(a) * length(b);
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

bool finite(const Vec3& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

void requireCamera(bool good, const char* otherwise) {
  if (!good) throw UsageError(otherwise);
}

}  // namespace

Camera fitCamera(const Box& box, const CameraWish& wish, Resolution resolution) {
  const double aspect = double(resolution.width) / resolution.height;
  const double radius = boundingRadius(box);
  Camera camera;
  camera.projection = wish.projection;
  camera.fov = wish.fov.value_or(camera.fov);
  camera.height = wish.height.value_or(2.0 * radius / std::min(1.0, aspect));
  camera.center = wish.center.value_or(middle(box));
  const double distance = fittingDistance(radius, camera.fov, aspect);
  camera.eye = wish.eye.value_or(sum(camera.center, scaled(unit(kFromCenter), distance)));
  camera.up = wish.up.value_or(defaultUp(camera));
  return camera;
}

Camera turned(const Camera& camera, double degrees) {
  const Vec3 axis = unit(camera.up), arm = difference(camera.eye, camera.center);
  const double c = std::cos(radians(degrees)), s = std::sin(radians(degrees));
  // Rodrigues' rotation formula.
  const Vec3 along = scaled(axis, inner(axis, arm) * (1.0 - c));
  Camera result = camera;
  result.eye = sum(camera.center, sum(along, sum(scaled(arm, c), scaled(cross(axis, arm), s))));
  return result;
}

void checkCamera(const Camera& camera, Resolution resolution) {
  requireCamera(finite(camera.eye) && finite(camera.center) && finite(camera.up),
                "the camera has a place that is not finite");
  const Vec3 view = difference(camera.center, camera.eye);
  requireCamera(length(view) > 0.0, "the camera's eye is at the point it looks at");
  requireCamera(length(camera.up) > 0.0, "the camera's up has no length");
  requireCamera(!parallel(view, camera.up), "the camera looks along its up direction");
  requireCamera(camera.fov > 0.0 && camera.fov < 180.0,
                "the field of view must be from 0 to 180 degrees");
  requireCamera(camera.height > 0.0 && std::isfinite(camera.height),
                "the height of the picture in voxels must be positive");
  requireCamera(resolution.width > 0 && resolution.height > 0, "a picture needs a pixel at least");
  requireCamera(std::max(resolution.width, resolution.height) <= Resolution::kMaxSide,
                "a picture may have 32767 pixels a side at most");
}

View::View(const Camera& camera, Resolution resolution)
    : eye(camera.eye), perspective(camera.projection == Projection::kPerspective) {
  forward = unit(difference(camera.center, camera.eye));
  right = unit(cross(forward, camera.up));
  up = cross(right, forward);
  const double height = perspective ? 2.0 * std::tan(radians(camera.fov) / 2) : camera.height;
  pixel = height / resolution.height;
  left = -pixel * resolution.width / 2;
  top = pixel * resolution.height / 2;
}

}  // namespace esvr
