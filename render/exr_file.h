#pragma once
/// Encodes pictures as OpenEXR files with 32-bit floats.

#include <cstddef>
#include <string>
#include <vector>

#include "esvr/image.h"

namespace esvr::render {

struct ExrText {
  std::string software;  ///< program that wrote the file
  std::string comment;   ///< its command line
};

/// Encodes the channels R, G, B and A, premultiplied and in linear light, as the format requires.
/// The colors of pictures are sRGB and are converted before they are premultiplied.
/// \throws RuntimeFailure  with OpenEXR's message
[[nodiscard]] std::vector<std::byte> encodeExr(const Image& image, const ExrText& text);

/// Encodes the distances of a picture that was drawn with RenderMode::kDepth as the channel Z.
/// Pixels without a distance, which have an alpha of 0, are infinite.
/// \throws RuntimeFailure  as for encodeExr
[[nodiscard]] std::vector<std::byte> encodeDepthExr(const Image& image, const ExrText& text);

}  // namespace esvr::render
