#pragma once
/// Text of unknown origin as UTF-8.

#include <string>
#include <string_view>

namespace esvr::report {

/// What is no UTF-8, or a control character but a line's end, becomes '?'.
[[nodiscard]] std::string validUtf8(std::string_view text);

}  // namespace esvr::report
