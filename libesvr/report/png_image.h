#pragma once
/// Converts pictures to PNG.

#include <string>

#include "esvr/image.h"

namespace esvr::report {

/// The colors in front of black with 8 bits per channel, as PNG.
/// \throws RuntimeFailure  cairo reports an error
[[nodiscard]] std::string toPng(const Image& image);

}  // namespace esvr::report
