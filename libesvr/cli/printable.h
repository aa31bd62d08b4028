#pragma once
/// Text of unknown origin on its way to a terminal.

#include <string>

namespace esvr::cli {

/// Control characters become '?': a grid's or a file's name could otherwise move the cursor or
/// worse. Line ends stay.
[[nodiscard]] std::string printable(std::string text);

}  // namespace esvr::cli
