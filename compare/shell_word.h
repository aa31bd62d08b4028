#pragma once
#include <string>

namespace esvr::compare {

/// A word as a shell takes it, in quotes where it needs them.
[[nodiscard]] std::string shellWord(const std::string& word);

}  // namespace esvr::compare
