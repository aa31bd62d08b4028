#pragma once
/// Encodes pictures as JPEG files.

#include <string>

#include "esvr/image.h"
#include "esvr/transfer_function.h"

namespace esvr::view {

struct JpegForm {
  Rgb background;         ///< color behind the picture
  double quality = 0.85;  ///< 0 to 1
};

/// Encodes a picture in sRGB, with colors at full resolution.
/// \throws RuntimeFailure  with the message of libjpeg
[[nodiscard]] std::string encodeJpeg(const Image& image, const JpegForm& form);

}  // namespace esvr::view
