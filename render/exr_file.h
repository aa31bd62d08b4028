#pragma once
/// Pictures as OpenEXR: 32-bit floats.

#include <cstddef>
#include <string>
#include <vector>

#include "esvr/image.h"

namespace esvr::render {

struct ExrText {
  std::string software;  ///< who wrote it
  std::string comment;   ///< how
};

/// Channels R, G, B, A: premultiplied, in linear light, as the format wants them. Colors, which are
/// a screen's here, are converted before they are premultiplied.
/// \throws RuntimeFailure  OpenEXR's own words
[[nodiscard]] std::vector<std::byte> encodeExr(const Image& image, const ExrText& text);

/// Channel Z: the red of a picture drawn with RenderMode::kDepth; infinite where its alpha is 0.
/// \throws RuntimeFailure  as encodeExr
[[nodiscard]] std::vector<std::byte> encodeDepthExr(const Image& image, const ExrText& text);

}  // namespace esvr::render
