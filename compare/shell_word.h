#pragma once
#include <string>

namespace esvr::compare {

/// A word for a shell, with quotes if it needs them.
[[nodiscard]] std::string shellWord(const std::string& word);

}  // namespace esvr::compare
