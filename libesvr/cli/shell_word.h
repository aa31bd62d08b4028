#pragma once
/// Commands as text.

#include <string>

namespace esvr::cli {

/// A word for a shell, with quotes if it needs them.
[[nodiscard]] std::string shellWord(const std::string& word);

}  // namespace esvr::cli
