#pragma once
/// Sizes for people.

#include <string>

namespace esvr {

/// For example "512 MB" or "1.5 GB".
[[nodiscard]] std::string byteText(double bytes);

}  // namespace esvr
