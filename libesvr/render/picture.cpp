#include "render/picture.h"

#include <cmath>

#include "esvr/error.h"

namespace esvr {
namespace {

void requirePositive(double value, const char* what) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw UsageError(std::string(what) + " must be positive, not " + std::to_string(value));
}

void checkShading(const RenderOptions& options) {
  if (!options.shading) return;
  if (options.mode != RenderMode::kComposite)
    throw UsageError("only composited pictures can be shaded");
  (void)lightRule(*options.shading, View(options.camera, options.resolution), options.transfer);
}

void checkClip(const PlaceBox& box) {
  for (int a = 0; a < 3; ++a)
    if (!(box.low[a] <= box.high[a])) throw UsageError("a clip box must not end before it begins");
}

void requireLooks(const RenderOptions& options, std::size_t grids) {
  const std::size_t looks = options.further.size() + 1;
  if (looks != grids)
    throw UsageError("a picture of " + std::to_string(grids) + " grids needs as many looks, not " +
                     std::to_string(looks));
}

const RenderOptions& checked(const RenderOptions& options, std::size_t grids) {
  checkRenderOptions(options, grids);
  return options;
}

}  // namespace

void checkRenderOptions(const RenderOptions& options, std::size_t grids) {
  requireLooks(options, grids);
  checkCamera(options.camera, options.resolution);
  checkTransferFunction(options.transfer);
  for (const GridLook& look : options.further) checkTransferFunction(look.transfer);
  requirePositive(options.step, "the step");
  requirePositive(options.opacityLength, "the opacity's length");
  if (!(options.minTransmittance >= 0.0 && options.minTransmittance < 1.0))
    throw UsageError("the transmittance that ends a ray must be from 0 to below 1");
  checkShading(options);
  if (options.clip) checkClip(*options.clip);
}

void refuseShading(const RenderOptions& options) {
  if (options.shading)
    throw UsageError("sums of ellipsoids and NanoVDB grids cannot be shaded; draw voxels");
}

MarchScene marchScene(const RenderOptions& o, const View& view, const SampleRule& rule) {
  MarchScene scene{view, {}, o.step, clipOf(o), rule};
  scene.isShaded = o.shading.has_value();
  if (o.shading) scene.light = lightRule(*o.shading, view, o.transfer);
  return scene;
}

Picture::Picture(const RenderOptions& options, const PlaceBox& box, std::size_t grids)
    : view(viewOf(checked(options, grids), box)),
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
