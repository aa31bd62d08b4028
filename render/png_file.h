#pragma once
/// Pictures as PNG.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "esvr/render.h"

namespace esvr::render {

struct PngText {
  std::string software;  ///< who wrote it
  std::string comment;   ///< how; UTF-8
};

/// 8 bits a channel, sRGB: the picture before a background, or RGBA with colors that are not
/// premultiplied. \throws RuntimeFailure  libpng's own words
[[nodiscard]] std::vector<std::byte> encodePng(const Image& image,
                                               const std::optional<Rgb>& background,
                                               const PngText& text);

}  // namespace esvr::render
