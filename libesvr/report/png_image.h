#pragma once
/// Rendered pictures as PNG.

#include <string>

#include "esvr/image.h"

namespace esvr::report {

/// The colors in front of black, 8 bits each. \throws RuntimeFailure
[[nodiscard]] std::string toPng(const Image& image);

}  // namespace esvr::report
