#pragma once
/// Text of unknown origin that is printed to a terminal.

#include <string>

namespace esvr::cli {

/// Replaces control characters by '?', because the name of a grid or a file could otherwise control
/// the terminal. Line ends stay.
[[nodiscard]] std::string printable(std::string text);

}  // namespace esvr::cli
