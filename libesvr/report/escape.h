#pragma once
/// Escapes text of unknown origin for HTML and XML.

#include <string>
#include <string_view>

namespace esvr::report {

/// Replaces markup characters by entities, and what shownText() (esvr/grid_names.h) replaces but line
/// feeds.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace esvr::report
