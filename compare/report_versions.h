#pragma once
/// What a report says of the programs that made it.

#include <string>
#include <vector>

namespace esvr::compare {

/// Words as one line.
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// A line for the program, the format and each library.
[[nodiscard]] std::vector<std::string> versions();

}  // namespace esvr::compare
