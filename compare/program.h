#pragma once
/// What the jobs of esvr-compare share.

#include <string>
#include <vector>

namespace esvr::compare {

inline constexpr const char* kProgram = "esvr-compare";

/// The command line as given. \param argv  the job's word first
[[nodiscard]] inline std::vector<std::string> commandLine(int argc, const char* const* argv) {
  std::vector<std::string> words{kProgram};
  words.insert(words.end(), argv, argv + argc);
  return words;
}

}  // namespace esvr::compare
