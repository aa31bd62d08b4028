#include "render/supersample.h"

namespace esvr::render {

Image drawSupersampled(Renderer& renderer, RenderOptions options, int samples) {
  if (samples == 1) return renderer.draw(options);
  options.lod = LevelOfDetail::kOff;
  options.resolution.width *= samples;
  options.resolution.height *= samples;
  return meansOfSquares(renderer.draw(options), samples);
}

}  // namespace esvr::render
