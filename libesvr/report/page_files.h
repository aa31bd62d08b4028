#pragma once
/// The style and the script of pages. render/page/build.mjs bundles them.

#include <string_view>

namespace esvr::report {

[[nodiscard]] std::string_view pageStyle();
[[nodiscard]] std::string_view pageScript();

}  // namespace esvr::report
