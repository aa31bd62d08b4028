#pragma once
/// Runs programs for the tests as a user does.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace esvr::test {

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the number of the signal if a signal ended the program
  std::string out, err;
};

/// A program that runs without a shell, so that the arguments arrive unchanged. The standard input is
/// empty.
class RunningProgram {
 public:
  RunningProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments);
  /// Kills the program if nobody has waited for it.
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  [[nodiscard]] bool runs() const;
  /// What it has printed so far.
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  void send(int signal) const;
  /// True if the program has a handler for SIGINT (proc(5), SigCgt).
  [[nodiscard]] bool handlesInterrupts() const;
  /// Waits for the end.
  ProgramRun wait();

 private:
  TemporaryFolder folder_;
  pid_t id_ = 0;
};

/// Runs a program until it ends.
ProgramRun runProgram(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments);

/// Interrupts the program with SIGINT as soon as it handles this signal and its error output
/// contains `sign`.
ProgramRun runInterrupted(const std::filesystem::path& program,
                          const std::vector<std::string>& arguments, const std::string& sign = "");

void writeText(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string readText(const std::filesystem::path& path);

class FolderTest : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::uintmax_t sizeOf(const std::string& name) const {
    return std::filesystem::file_size(at(name));
  }
  /// The names of all files that are no inputs, whose names begin with "in.".
  [[nodiscard]] std::vector<std::string> outputs() const {
    std::vector<std::string> names = folder_.names();
    std::erase_if(names, [](const std::string& name) { return name.starts_with("in."); });
    return names;
  }
  TemporaryFolder folder_;
};

struct Refusal {
  std::vector<std::string> arguments;  ///< "DIR/" stands for the test's folder
  int code;
  const char* words;  ///< in the message

  [[nodiscard]] std::vector<std::string> argumentsIn(const TemporaryFolder& folder) const {
    const std::string place = folder / "";
    std::vector<std::string> all = arguments;
    for (std::string& argument : all)
      for (std::size_t i = 0; (i = argument.find("DIR/", i)) != std::string::npos;
           i += place.size())
        argument.replace(i, 4, place);
    return all;
  }
  void expectOf(const ProgramRun& run) const {
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr(words));
  }
};
inline std::ostream& operator<<(std::ostream& out, const Refusal& refusal) {
  return out << testing::PrintToString(refusal.arguments);
}

}  // namespace esvr::test
