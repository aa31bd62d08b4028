#pragma once
/// The programs and versions that a report names.

#include <string>
#include <vector>

namespace esvr::compare {

/// Joins words to one line.
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// One line for the program, the format and each library.
[[nodiscard]] std::vector<std::string> versions();

}  // namespace esvr::compare
