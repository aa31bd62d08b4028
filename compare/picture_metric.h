#pragma once
/// A figure of two pictures from a program of the user's: LPIPS, by the model and runtime at hand.

#include <filesystem>
#include <string>

#include "esvr/image.h"

namespace esvr::compare {

class PictureMetric {
 public:
  /// \param command  words for a shell, run with the reference's and the picture's file after them;
  ///                 what it prints last is the figure
  /// \param folder   for the two files, PNG of 8 bits in front of black
  PictureMetric(std::string command, std::filesystem::path folder);

  /// \throws RuntimeFailure  the command fails, or prints no number
  [[nodiscard]] double of(const Image& reference, const Image& picture) const;

 private:
  std::string command_;
  std::filesystem::path folder_;
};

}  // namespace esvr::compare
