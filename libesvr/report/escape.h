#pragma once
/// Escapes text of unknown origin for HTML and XML.

#include <string>
#include <string_view>

namespace esvr::report {

/// Replaces markup characters by entities. Bytes that are not UTF-8 and control characters other
/// than line feeds become '?'.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace esvr::report
