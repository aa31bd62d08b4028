#pragma once
/// Runs a program for the tests as a user does.

#include <filesystem>
#include <string>
#include <vector>

namespace esvr::test {

struct ProgramRun {
  int exitCode = -1;  ///< 128 + the number of the signal if a signal ended the program
  std::string out, err;
};

/// Runs without a shell, so that the arguments arrive unchanged. The standard input is empty.
ProgramRun runProgram(const std::filesystem::path& program,
                      const std::vector<std::string>& arguments);

/// A folder that is removed at the end of the test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return path_ / name;
  }
  /// The sorted names of all files in the folder.
  [[nodiscard]] std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

void writeText(const std::filesystem::path& path, const std::string& text);
[[nodiscard]] std::string readText(const std::filesystem::path& path);

}  // namespace esvr::test
