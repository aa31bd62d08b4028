#pragma once
/// Converts text of unknown origin to valid UTF-8.

#include <string>
#include <string_view>

namespace esvr::report {

/// Replaces bytes that are not UTF-8, and control characters other than line feeds, by '?'.
[[nodiscard]] std::string validUtf8(std::string_view text);

}  // namespace esvr::report
