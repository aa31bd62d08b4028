#include "render/picture.h"

#include <cmath>

#include "esvr/error.h"

namespace esvr {
namespace {

void requirePositive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw UsageError(std::string(what) + " must be positive, not " + std::to_string(value));
}

void checkClip(const PlaceBox& box) {
  for (int a = 0; a < 3; ++a)
    if (!(box.low[a] <= box.high[a])) throw UsageError("a clip box must not end before it begins");
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
  if (options.clip) checkClip(*options.clip);
}

Picture::Picture(const RenderOptions& options)
    : view(checked(options).camera, options.resolution),
      table(options.transfer, samplingOf(options)),
      image_{options.resolution.width, options.resolution.height, {}} {
  image_.rgba.resize(std::size_t(4) * std::size_t(image_.width) * std::size_t(image_.height));
}

void Picture::set(int column, int row, const PixelColor& color) {
  float* pixel =
      &image_.rgba[4 * (std::size_t(row) * std::size_t(image_.width) + std::size_t(column))];
  pixel[0] = color.r, pixel[1] = color.g, pixel[2] = color.b, pixel[3] = color.alpha;
}

void checkCancelled(const RenderOptions& options) {
  if (options.cancel != nullptr && options.cancel->cancelled()) throw Cancelled();
}

}  // namespace esvr
