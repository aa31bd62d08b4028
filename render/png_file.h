#pragma once
/// Encodes pictures as PNG files.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "esvr/render.h"

namespace esvr::render {

struct PngText {
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
                                               const PngText& text);

}  // namespace esvr::render
