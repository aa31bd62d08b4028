#pragma once
/// A metric of two pictures that a program of the user computes, for example LPIPS.

#include <filesystem>
#include <string>

#include "esvr/image.h"

namespace esvr::compare {

class PictureMetric {
 public:
  /// \param command  shell command that gets the files of the reference and the picture as
  ///                 arguments; the last word of its output is the figure
  /// \param folder   folder for the two files, which are 8-bit PNG in front of black
  PictureMetric(std::string command, std::filesystem::path folder);

  /// \throws RuntimeFailure  the command fails, or its last word is not a number
  [[nodiscard]] double of(const Image& reference, const Image& picture) const;

 private:
  std::string command_;
  std::filesystem::path folder_;
};

}  // namespace esvr::compare
