#include "render/picture.h"

#include <cmath>

#include "esvr/error.h"

namespace esvr {
namespace {

void requirePositive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw UsageError(std::string(what) + " must be positive, not " + std::to_string(value));
}

const RenderOptions& checked(const RenderOptions& options) {
  checkRenderOptions(options);
  return options;
}

}  // namespace

void checkRenderOptions(const RenderOptions& options) {
  checkCamera(options.camera, options.resolution);
  checkTransferFunction(options.transfer);
  requirePositive(options.step, "the step");
  requirePositive(options.opacityLength, "the opacity's length");
  if (!(options.minTransmittance >= 0.0 && options.minTransmittance < 1.0))
    throw UsageError("the transmittance that ends a ray must be from 0 to below 1");
}

Picture::Picture(const RenderOptions& options)
    : view(checked(options).camera, options.resolution),
      table(options.transfer, options.step / options.opacityLength),
      image_{options.resolution.width, options.resolution.height, {}} {
  image_.rgba.resize(std::size_t(4) * std::size_t(image_.width) * std::size_t(image_.height));
}

void Picture::set(int column, int row, const RayState& ray) {
  float* pixel =
      &image_.rgba[4 * (std::size_t(row) * std::size_t(image_.width) + std::size_t(column))];
  pixel[0] = ray.r, pixel[1] = ray.g, pixel[2] = ray.b;
  pixel[3] = 1.0f - ray.transmittance;
}

void checkCancelled(const RenderOptions& options) {
  if (options.cancel != nullptr && options.cancel->cancelled()) throw Cancelled();
}

}  // namespace esvr
