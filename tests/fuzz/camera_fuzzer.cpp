// Reads cameras of esvr-render. A camera that is accepted and checked has finite positions.

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "esvr/camera.h"
#include "esvr/error.h"
#include "fuzz/input_file.h"
#include "render/camera_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static esvr::fuzz::InputFile file(".json");
  try {
    const esvr::CameraWish wish = esvr::render::readCamera(file.write(data, size));
    const esvr::Resolution resolution{64, 48};
    const esvr::Camera camera = esvr::fitCamera({{0, 0, 0}, {9, 9, 9}}, wish, resolution);
    esvr::checkCamera(camera, resolution);
    for (const double x : camera.eye)
      if (!std::isfinite(x)) std::abort();
  } catch (const esvr::BadInput&) {
  } catch (const esvr::UsageError&) {
  }
  return 0;
}
