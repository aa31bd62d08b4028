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

struct PngForm {
  std::optional<Rgb> background;  ///< the picture before it, else RGBA
  int bits = 8;                   ///< a channel: 8 or 16
};

/// sRGB; colors that are not premultiplied. \throws RuntimeFailure  libpng's own words
[[nodiscard]] std::vector<std::byte> encodePng(const Image& image, const PngForm& form,
                                               const PngText& text);

}  // namespace esvr::render
