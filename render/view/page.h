#pragma once
/// The pages that the build embeds.

#include <string_view>

namespace esvr::view {

/// The viewer as one HTML file.
[[nodiscard]] std::string_view viewPage();

/// The viewer that draws by itself, without a file in it (exported_page.h).
[[nodiscard]] std::string_view exportPageBundle();

}  // namespace esvr::view
