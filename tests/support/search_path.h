#pragma once
/// Stand-ins for programs that are found in PATH.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/temporary_folder.h"

namespace esvr::test {

/// Makes PATH begin with a folder of its own until the test is over. Tests of one process run one
/// after the other, so that no other test sees the change.
class SearchPath {
 public:
  SearchPath() : before_(std::getenv("PATH")) { set(folder_.path().string() + ":" + before_); }
  ~SearchPath() { set(before_); }
  SearchPath(const SearchPath&) = delete;
  SearchPath& operator=(const SearchPath&) = delete;

  /// Adds a program that is a script for /bin/sh.
  void add(const std::string& name, const std::string& script) const {
    const std::filesystem::path file = folder_ / name;
    std::ofstream(file) << "#!/bin/sh\n" << script << '\n';
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
  /// Leaves only the programs that were added.
  void hideOthers() const { set(folder_.path().string()); }

 private:
  static void set(const std::string& path) { ::setenv("PATH", path.c_str(), 1); }

  TemporaryFolder folder_;
  std::string before_;
};

/// Lines of a script that stands for ffmpeg: it sets $out to the file that ffmpeg would write.
inline constexpr const char* kOutputOfFfmpeg = "for out; do :; done; out=${out#file:}\n";

}  // namespace esvr::test
