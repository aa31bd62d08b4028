#pragma once
/// Runs a program for the tests as a user does.

#include <filesystem>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace esvr::test {

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the number of the signal if a signal ended the program
  std::string out, err;
};

/// Runs without a shell, so that the arguments arrive unchanged. The standard input is empty.
ProgramRun runProgram(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments);

/// Interrupts the program with SIGINT as soon as it handles this signal and its error output
/// contains `sign`.
ProgramRun runInterrupted(const std::filesystem::path& program,
                          const std::vector<std::string>& arguments, const std::string& sign = "");

void writeText(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string readText(const std::filesystem::path& path);

}  // namespace esvr::test
