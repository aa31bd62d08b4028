#pragma once
/// The names of the files that esvr-render writes.

#include <filesystem>
#include <vector>

#include "render/options.h"

namespace esvr::render {

/// The files of one picture; an empty name stands for no file.
struct PictureFiles {
  int frame = 0;                  ///< number of the picture in a turn
  std::filesystem::path picture;  ///< empty for a video, which has no files for its pictures
  std::filesystem::path sheet, depth;
};

/// The file of a frame: the number replaces %d or %04d in the name, or comes before the extension.
/// "turn.png" becomes "turn.0007.png". A folder gets the file "frame.0007.png".
[[nodiscard]] std::filesystem::path frameName(const std::filesystem::path& output, int frame);

/// The file of a picture's error map: "turn.0007.error.png" for "turn.0007.png".
[[nodiscard]] std::filesystem::path errorName(const std::filesystem::path& picture);

/// The files of a frame of a sequence, whose number replaces the pattern in the names.
[[nodiscard]] PictureFiles filesOfFrame(const Options& options, cli::FrameNumber frame);

/// The files of all pictures that the options ask for.
[[nodiscard]] std::vector<PictureFiles> pictureFiles(const Options& options);

/// Checks all files before anything is drawn, so that a mistake costs no time. A folder for a
/// turntable whose name ends in '/' is created.
/// \throws UsageError, RuntimeFailure  a file has a wrong name or cannot be written; a video cannot
///                                     be made
void checkFiles(const Options& options);

}  // namespace esvr::render
