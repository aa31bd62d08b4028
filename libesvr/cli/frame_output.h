#pragma once
/// The outputs of frames.

#include <filesystem>
#include <vector>

namespace esvr::cli {

/// Makes the folder of a frame's output if it does not exist, because the name of a folder may have
/// the number of the frame. If the folder is still empty when the object goes out of scope, it is
/// removed again.
class FrameFolder {
 public:
  /// \throws RuntimeFailure  the folder cannot be made
  explicit FrameFolder(const std::filesystem::path& output);
  ~FrameFolder();
  FrameFolder(const FrameFolder&) = delete;
  FrameFolder& operator=(const FrameFolder&) = delete;

 private:
  std::vector<std::filesystem::path> made_;  ///< the innermost first
};

/// Copies the output of a frame to that of another one. The copy appears under its name when it is
/// complete.
/// \throws RuntimeFailure  the copy exists (without `overwrite`) or is not writable; the disk is
///                         full
void copyOutput(const std::filesystem::path& from, const std::filesystem::path& to, bool overwrite);

}  // namespace esvr::cli
