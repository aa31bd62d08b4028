#pragma once
/// Draws pictures whose pixels are means of several rays.

#include "esvr/renderer.h"

namespace esvr::render {

/// Draws a reference picture, without levels of detail if a pixel has several rays.
/// \param samples  rays along the side of a pixel
[[nodiscard]] Image drawSupersampled(Renderer& renderer, RenderOptions options, int samples);

}  // namespace esvr::render
