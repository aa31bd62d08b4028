#pragma once
/// Runs programs for the tests as a user does.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "support/files.h"
#include "support/messages.h"

namespace esvr::test {

using Json = nlohmann::json;

/// Arguments as a list, or as a text with spaces between them.
struct Words : std::vector<std::string> {
  using vector::vector;
  Words() = default;
  Words(std::vector<std::string> words) : vector(std::move(words)) {}
  Words(const char* text) {
    std::istringstream words(text);
    for (std::string word; words >> word;) push_back(word);
  }
};

/// One list of arguments after the other.
[[nodiscard]] inline Words joined(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the number of the signal if a signal ended the program
  std::string out, err;
};
inline std::ostream& operator<<(std::ostream& out, const ProgramRun& run) {
  return out << "exit code " << run.exitCode << '\n' << run.out << run.err;
}

/// \return the run, which must have ended with 0: otherwise the test fails here, with what it printed
ProgramRun succeeded(ProgramRun run, const char* file = __builtin_FILE(),
                     int line = __builtin_LINE());

/// How often a text has these words.
[[nodiscard]] inline std::size_t timesIn(const std::string& text, const std::string& words) {
  std::size_t count = 0;
  for (auto at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
  return count;
}

/// A run that ended with this code and an error output that has these parts.
template <class... Parts>
auto Fails(int code, const Parts&... parts) {
  return testing::AllOf(testing::Field("exitCode", &ProgramRun::exitCode, code),
                        testing::Field("err", &ProgramRun::err, Says(parts...)));
}

/// A program that runs without a shell, so that the arguments arrive unchanged. The standard input is
/// empty.
class RunningProgram {
 public:
  RunningProgram(const std::filesystem::path& program, const Words& arguments);
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
ProgramRun runProgram(const std::filesystem::path& program, const Words& arguments);

/// Runs a line of a shell.
inline ProgramRun runShell(const std::string& line) { return runProgram("/bin/sh", {"-c", line}); }

/// Interrupts the program with SIGINT as soon as it handles this signal and its error output
/// contains `sign`.
ProgramRun runInterrupted(const std::filesystem::path& program, const Words& arguments,
                          const std::string& sign = "");

class FolderTest : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::uintmax_t sizeOf(const std::string& name) const {
    return std::filesystem::file_size(at(name));
  }
  /// The names of all files that are no inputs, whose names begin with "in.".
  [[nodiscard]] Words outputs() const {
    Words names = folder_.names();
    std::erase_if(names, [](const std::string& name) { return name.starts_with("in."); });
    return names;
  }
  TemporaryFolder folder_;
};

struct Refusal {
  Words arguments;  ///< "DIR/" stands for the test's folder
  int code;
  const char* words;  ///< in the message

  [[nodiscard]] Words argumentsIn(const TemporaryFolder& folder) const {
    const std::string place = folder / "";
    Words all = arguments;
    for (std::string& argument : all)
      for (std::size_t i = 0; (i = argument.find("DIR/", i)) != std::string::npos;
           i += place.size())
        argument.replace(i, 4, place);
    return all;
  }
  void expectOf(const ProgramRun& run) const { EXPECT_THAT(run, Fails(code, words)); }
};
inline std::ostream& operator<<(std::ostream& out, const Refusal& refusal) {
  return out << testing::PrintToString(refusal.arguments);
}

}  // namespace esvr::test
