#pragma once
/// Runs a program as a user would, for tests of the programs.

#include <filesystem>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace esvr::test {

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the signal's number where a signal ended it
  std::string out, err;
};

/// Without a shell: the arguments arrive as they are; standard input is empty.
ProgramRun runProgram(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments);

void writeText(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string readText(const std::filesystem::path& path);

}  // namespace esvr::test
