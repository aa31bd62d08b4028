#include <algorithm>

#include "capi/objects.h"
#include "esvr/camera.h"
#include "page/page.h"

using namespace esvr;

namespace {

Projection projectionOf(int orthographic) {
  return orthographic != 0 ? Projection::kOrthographic : Projection::kPerspective;
}

Vec3 placeAt(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

}  // namespace

void page_fit(const int* box, const double* direction, int orthographic, int width, int height,
              double* camera) {
  CameraWish wish;
  wish.projection = projectionOf(orthographic);
  if (direction != nullptr) wish.direction = placeAt(direction);
  const Box voxels{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  const Camera fitted = fitCamera(voxels, wish, {width, height});
  for (const Vec3& place : {fitted.eye, fitted.center, fitted.up})
    camera = std::copy(place.begin(), place.end(), camera);
  *camera = orthographic != 0 ? fitted.height : fitted.fov;
}

esvr_status page_check_camera(const double* camera, int orthographic, int width, int height) {
  return capi::guarded([&] {
    Camera c{placeAt(camera), placeAt(camera + 3), placeAt(camera + 6), projectionOf(orthographic)};
    (orthographic != 0 ? c.height : c.fov) = camera[9];
    checkCamera(c, {width, height});
  });
}
