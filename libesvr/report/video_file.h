#pragma once
/// Videos, which the program ffmpeg encodes.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "esvr/image.h"
#include "report/child_program.h"

namespace esvr::report {

/// True if the name ends in .mp4 or .webm.
[[nodiscard]] bool isVideo(const std::filesystem::path& path);

/// \throws UsageError  ffmpeg is not in PATH
[[nodiscard]] std::filesystem::path findFfmpeg();

/// \throws UsageError  a side is odd, which a video with colors of half resolution cannot have
void checkVideoSize(int width, int height);

struct VideoForm {
  int width = 0, height = 0;           ///< pixels; even numbers
  double fps = 30.0;                   ///< pictures per second
  std::array<double, 3> background{};  ///< sRGB color behind the pictures
  std::string comment;                 ///< text for the metadata
  bool overwrite = false;
};

/// A video that is being written: H.264 in an .mp4 file, VP9 in a .webm file. The pictures pass to
/// ffmpeg through its standard input. The file appears under its name when it is complete; nothing
/// is left of it otherwise.
class VideoFile {
 public:
  /// Starts ffmpeg. \param cancel  ends all waits for ffmpeg; must outlive this object
  /// \throws UsageError      ffmpeg is not in PATH
  /// \throws RuntimeFailure  the file exists (without `overwrite`) or is not writable
  VideoFile(std::filesystem::path path, const VideoForm& form, const CancelToken& cancel);

  /// \throws RuntimeFailure  ffmpeg has ended; the text has its last message
  /// \throws Cancelled
  void add(const Image& image);
  /// Waits for ffmpeg and gives the file its name. \throws RuntimeFailure, Cancelled  as for add
  void finish();

 private:
  [[noreturn]] void fail(const std::string& why) const;
  void checkEnd();

  std::filesystem::path path_;
  std::array<double, 3> background_;
  AtomicFile file_;
  ChildProgram ffmpeg_;  ///< behind the file, so that ffmpeg ends before the file is removed
};

}  // namespace esvr::report
