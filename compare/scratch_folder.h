#pragma once
/// A folder for temporary files.

#include <filesystem>

namespace esvr::compare {

/// Makes a folder in that of the variable TMPDIR, or in /var/tmp; the destructor removes it with its content.
class ScratchFolder {
 public:
  /// \throws UsageError  TMPDIR is no folder
  /// \throws RuntimeFailure  the folder cannot be made
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace esvr::compare
