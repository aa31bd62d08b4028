#pragma once
/// Common parts of the commands of esvr-compare.

#include <string>
#include <vector>

namespace esvr::compare {

inline constexpr const char* kProgram = "esvr-compare";

/// The whole command line as words. \param argv  arguments, beginning with the command
[[nodiscard]] inline std::vector<std::string> commandLine(int argc, const char* const* argv) {
  std::vector<std::string> words{kProgram};
  words.insert(words.end(), argv, argv + argc);
  return words;
}

}  // namespace esvr::compare
