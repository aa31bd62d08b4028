#pragma once
/// The page that the build embeds.

#include <string_view>

namespace esvr::view {

/// The viewer as one HTML file.
[[nodiscard]] std::string_view viewPage();

}  // namespace esvr::view
