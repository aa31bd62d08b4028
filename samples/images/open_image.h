#pragma once
/// Opens an image of any format.

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "images/image_choice.h"
#include "images/image_source.h"

namespace esvr::samples {

struct ImageRequest {
  std::vector<std::filesystem::path> paths;  ///< several only for TIFF
  std::optional<RawLayout> raw;              ///< needed for a RAW image; others do not use it
  ImageChoice choice;
};

/// \throws BadInput  a file cannot be read, or the build does not read its format
/// \throws UsageError  the request does not fit the format
/// \throws MemoryExceeded  the image does not fit into memory
[[nodiscard]] std::unique_ptr<ImageSource> openImage(const ImageRequest& request);

}  // namespace esvr::samples
