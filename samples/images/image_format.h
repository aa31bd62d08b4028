#pragma once
/// The formats of images, and which of them a build reads.

#include <filesystem>
#include <string>

namespace esvr::samples {

enum class ImageFormat { kRaw, kNrrd, kTiff, kNifti, kVti, kHdf5 };

/// The format by the first bytes of a file, else by the end of its name, else kRaw.
/// \throws BadInput  the file does not exist or cannot be read
[[nodiscard]] ImageFormat imageFormat(const std::filesystem::path& path);

/// "TIFF"
[[nodiscard]] std::string nameOf(ImageFormat format);

/// Whether the library that reads a format was there when the program was built.
[[nodiscard]] bool isBuilt(ImageFormat format);

/// \throws BadInput  the build does not read the format; the text names the package with the
///                   library, and the file
void requireBuilt(ImageFormat format, const std::filesystem::path& path);

/// The formats that this build reads, and the packages of those that it does not read. For --help.
[[nodiscard]] std::string textOfFormats();

/// True for names that end like those of TIFF files.
[[nodiscard]] bool hasTiffName(const std::filesystem::path& path);

}  // namespace esvr::samples
