#pragma once
/// Text for a terminal.

#include <cstddef>
#include <string>

namespace esvr::cli {

/// Breaks the lines of a text between words, so that none is longer than `width` characters unless
/// it is one word. Lines that begin with a space have columns, and stay as they are.
[[nodiscard]] std::string wrapped(const std::string& text, std::size_t width);

}  // namespace esvr::cli
