#pragma once
/// The files of an image, as a user names them.

#include <filesystem>
#include <string>
#include <vector>

namespace esvr::samples {

/// Files of an image in their order.
struct ImageFiles {
  std::vector<std::filesystem::path> paths;  ///< one, or the slices of a stack
  /// Whether they were named one by one in another order than that of the numbers in their names.
  bool outOfOrder = false;
  std::string hint{};  ///< files that look like slices of a pattern and are none; may be empty
};

/// Finds the files of one of these:
///
///     a.nii                   one file
///     a1.tif a2.tif ...       several files, in this order
///     slices/                 a folder: its TIFF files, in the order of the numbers in their names
///     slice_####.tif          a pattern for the number of a slice (cli/frame_pattern.h)
///
/// \throws BadInput  a folder or a pattern has no file, or a slice is missing
[[nodiscard]] ImageFiles imageFiles(const std::vector<std::string>& names);

/// Compares names as people do: a2 is before a10.
[[nodiscard]] bool isBefore(const std::string& a, const std::string& b);

}  // namespace esvr::samples
