#pragma once
/// Encodes pictures as PNG files, and as OpenEXR files with 32-bit floats.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "esvr/image.h"
#include "esvr/render.h"

namespace esvr::render {

/// The texts in the metadata of a file.
struct PictureText {
  std::string software;  ///< program that wrote the file
  std::string comment;   ///< its command line; UTF-8
};

struct PngForm {
  std::optional<Rgb> background;  ///< color behind the picture; default: an RGBA file
  int bits = 8;                   ///< bits of a channel, 8 or 16
};

/// Encodes a picture in sRGB, with colors that are not premultiplied.
/// \throws RuntimeFailure  with libpng's message
[[nodiscard]] std::vector<std::byte> encodePng(const Image& image, const PngForm& form,
                                               const PictureText& text);

/// Encodes the channels R, G, B and A, premultiplied and in linear light, as the format requires.
/// The colors of pictures are sRGB and are converted before they are premultiplied.
/// \throws RuntimeFailure  with OpenEXR's message
[[nodiscard]] std::vector<std::byte> encodeExr(const Image& image, const PictureText& text);

/// Encodes the distances of a picture that was drawn with RenderMode::kDepth as the channel Z.
/// Pixels without a distance, which have an alpha of 0, are infinite.
/// \throws RuntimeFailure  as for encodeExr
[[nodiscard]] std::vector<std::byte> encodeDepthExr(const Image& image, const PictureText& text);

}  // namespace esvr::render
