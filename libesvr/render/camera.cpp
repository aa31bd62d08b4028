#include "esvr/camera.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

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
