#pragma once
/// A folder for files that come and go.

#include <filesystem>

namespace esvr::compare {

/// In the system's place for temporary files; gone with all that is in it at the end.
class ScratchFolder {
 public:
  /// \throws RuntimeFailure  cannot be made
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace esvr::compare
