#pragma once
/// Options whose values are several numbers.

#include <string>
#include <vector>

namespace esvr::cli {

/// "1,-2.5,3e2": so many finite numbers. \throws UsageError  anything else; names the option
[[nodiscard]] std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                               std::size_t count);

}  // namespace esvr::cli
