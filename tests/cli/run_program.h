#pragma once
/// Runs a program as a user would, for tests of the programs.

#include <filesystem>
#include <string>
#include <vector>

namespace esvr::test {

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the signal's number where a signal ended it
  std::string out, err;
};

/// Without a shell: the arguments arrive as they are; standard input is empty.
ProgramRun runProgram(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments);

/// A folder that is gone when the test is over.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return path_ / name;
  }
  /// Names of all that is in it, sorted: what a run left behind.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

void writeText(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string readText(const std::filesystem::path& path);

}  // namespace esvr::test
