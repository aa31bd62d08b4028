#pragma once
/// The style and the script of pages. The build makes them from page.css and page.js.

#include <string_view>

namespace esvr::report {

[[nodiscard]] std::string_view pageStyle();
[[nodiscard]] std::string_view pageScript();

}  // namespace esvr::report
