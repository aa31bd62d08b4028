#pragma once
/// How the pages of a TIFF file form a stack of slices.

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace esvr::samples {

/// What the text of a TIFF file's first page says of all its pages.
struct StackLayout {
  std::size_t channels = 1;
  std::size_t slices = 1;     ///< slices of each channel
  bool channelsFirst = true;  ///< the pages of a slice's channels follow each other
  std::array<double, 3> voxelSize{1.0, 1.0, 1.0};
};

/// Properties of a file that its text refers to.
struct StackFile {
  std::filesystem::path path;  ///< the file, which messages name
  std::string text;            ///< ImageDescription of the first page; may be empty
  std::size_t pages = 1;
  /// Pixels per unit of length along x and y; 0 where it is missing.
  std::array<double, 2> resolution{};
};

/// The layout by the text of ImageJ or OME. Without such a text, each page is a slice of one
/// channel.
/// \throws BadInput  the text names a stack of other pages than the file has, or one that changes
///                   over time
[[nodiscard]] StackLayout stackLayout(const StackFile& file);

/// The number of pages that ImageJ names. It may be larger than that of the file, because ImageJ
/// writes large stacks as one page with the others behind it. Nothing for other texts.
[[nodiscard]] std::optional<std::size_t> imageJPages(const std::string& text);

/// The pages of a channel, from bottom to top.
[[nodiscard]] std::vector<std::size_t> pagesOf(const StackLayout& layout, std::size_t channel);

}  // namespace esvr::samples
