#pragma once
/// Text of unknown origin that is printed to a terminal.

#include <string>

namespace esvr::cli {

/// A text without what could control the terminal or pretend to be another line of the program, such as
/// the name of a grid or a file (shownText in esvr/grid_names.h).
[[nodiscard]] std::string printable(const std::string& text);

/// The same for a message of the program, which may have several lines. Names in it were made safe
/// before, because their line ends would stay.
[[nodiscard]] std::string printableMessage(const std::string& text);

}  // namespace esvr::cli
