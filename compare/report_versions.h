#pragma once
/// The programs and versions that a report names.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace esvr::compare {

/// Joins words to one line.
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

/// One line for the program, the format and each library.
[[nodiscard]] std::vector<std::string> versionLines();

/// The versions that reports of all programs have, and that of ZFP; null if there is none.
[[nodiscard]] nlohmann::ordered_json versionJson();

}  // namespace esvr::compare
