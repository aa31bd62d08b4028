#pragma once
/// Options whose values are several numbers.

#include <string>
#include <vector>

namespace esvr::cli {

/// Parses a text like "1,-2.5,3e2" with `count` finite numbers.
/// \throws UsageError  the text is not of this form; the message names the option
[[nodiscard]] std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                               std::size_t count);

}  // namespace esvr::cli
