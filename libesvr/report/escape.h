#pragma once
/// Text of unknown origin on its way into HTML, XML and UTF-8.

#include <string>
#include <string_view>

namespace esvr::report {

/// The text with markup's characters as entities; what is no UTF-8, or a control character but a
/// line's end, becomes '?'.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace esvr::report
