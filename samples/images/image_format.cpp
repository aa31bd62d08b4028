#include "images/image_format.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "esvr/error.h"
#include "images/zipped_file.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;
using std::string_view_literals::operator""sv;

struct FormatInfo {
  ImageFormat format;
  const char* name;
  const char* library;
  const char* package;  ///< of Debian
  bool isBuilt;
};

// samples/CMakeLists.txt defines ESVR_HAS_* as 0 or 1.
constexpr FormatInfo kFormats[] = {
    {ImageFormat::kRaw, "RAW", "", "", true},
    {ImageFormat::kNrrd, "NRRD", "teem", "libteem-dev", true},
    {ImageFormat::kTiff, "TIFF", "libtiff", "libtiff-dev", ESVR_HAS_TIFF},
    {ImageFormat::kNifti, "NIfTI", "libnifti2", "libnifti-dev", ESVR_HAS_NIFTI},
    {ImageFormat::kVti, "VTI", "expat", "libexpat1-dev", ESVR_HAS_VTI},
    {ImageFormat::kHdf5, "HDF5", "HDF5", "libhdf5-dev", ESVR_HAS_HDF5}};

const FormatInfo& infoOf(ImageFormat format) {
  return *std::ranges::find(kFormats, format, &FormatInfo::format);
}

constexpr std::pair<std::string_view, ImageFormat> kEndings[] = {
    {".nrrd", ImageFormat::kNrrd}, {".nhdr", ImageFormat::kNrrd}, {".tif", ImageFormat::kTiff},
    {".tiff", ImageFormat::kTiff}, {".nii", ImageFormat::kNifti}, {".nii.gz", ImageFormat::kNifti},
    {".vti", ImageFormat::kVti},   {".h5", ImageFormat::kHdf5},   {".hdf5", ImageFormat::kHdf5}};

std::optional<ImageFormat> formatByName(const fs::path& path) {
  std::string name = path.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  for (const auto& [ending, format] : kEndings)
    if (name.ends_with(ending)) return format;
  return std::nullopt;
}

constexpr std::size_t kHeadBytes = 4096;

/// The first bytes of a file.
std::string headOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw BadInput("cannot read " + path.string() + ": " + std::strerror(errno));
  std::string head(kHeadBytes, '\0');
  file.read(head.data(), std::streamsize(head.size()));
  head.resize(std::size_t(file.gcount()));
  return head;
}

bool hasAt(std::string_view head, std::size_t place, std::string_view sign) {
  return head.size() >= place + sign.size() && head.substr(place, sign.size()) == sign;
}

/// NIfTI-1 has its sign behind the header, and NIfTI-2 at the beginning.
bool isNifti(std::string_view head) {
  constexpr std::size_t kPlace1 = 344, kPlace2 = 4;
  return hasAt(head, kPlace1, "n+1\0"sv) || hasAt(head, kPlace1, "ni1\0"sv) ||
         hasAt(head, kPlace2, "n+2\0"sv) || hasAt(head, kPlace2, "ni2\0"sv);
}

bool isTiff(std::string_view head) {
  for (const auto sign : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv})
    if (head.starts_with(sign)) return true;
  return false;
}

/// The sign of HDF5 may follow data of other programs.
bool isHdf5(std::string_view head) {
  for (const std::size_t place : {0, 512, 1024, 2048})
    if (hasAt(head, place, "\x89HDF\r\n\x1a\n"sv)) return true;
  return false;
}

bool isVtkXml(std::string_view head) { return head.find("<VTKFile") != std::string_view::npos; }

/// The beginning of a file that gzip compressed. A damaged one is left to the reader.
std::string unzippedHead(const fs::path& path) try {
  std::array<std::byte, kHeadBytes> bytes{};
  const std::size_t count = ZippedFile(path).read(0, bytes);
  return {reinterpret_cast<const char*>(bytes.data()), count};
} catch (const BadInput&) {
  return {};
}

std::optional<ImageFormat> formatByContent(const fs::path& path) {
  const std::string head = headOf(path);
  if (isTiff(head)) return ImageFormat::kTiff;
  if (head.starts_with("NRRD")) return ImageFormat::kNrrd;
  if (isHdf5(head)) return ImageFormat::kHdf5;
  if (isNifti(head)) return ImageFormat::kNifti;
  if (isVtkXml(head)) return ImageFormat::kVti;
  if (head.starts_with("\x1f\x8b") && isNifti(unzippedHead(path))) return ImageFormat::kNifti;
  return std::nullopt;
}

}  // namespace

ImageFormat imageFormat(const fs::path& path) {
  if (const auto format = formatByContent(path)) return *format;
  return formatByName(path).value_or(ImageFormat::kRaw);
}

bool hasTiffName(const fs::path& path) { return formatByName(path) == ImageFormat::kTiff; }

std::string nameOf(ImageFormat format) { return infoOf(format).name; }

bool isBuilt(ImageFormat format) { return infoOf(format).isBuilt; }

void requireBuilt(ImageFormat format, const fs::path& path) {
  const FormatInfo& info = infoOf(format);
  if (!info.isBuilt)
    throw BadInput(path.string() + " has the format " + info.name + ", but this build has no " +
                   info.library + " (" + info.package + " was not found)");
}

std::string textOfFormats() {
  std::string built, missing;
  for (const FormatInfo& info : kFormats) {
    std::string& list = info.isBuilt ? built : missing;
    list += (list.empty() ? "" : ", ") + std::string(info.name);
    if (!info.isBuilt) list += std::string(" (") + info.package + ")";
  }
  return "This build reads " + built + "." +
         (missing.empty() ? "" : " Packages were missing for " + missing + ".");
}

}  // namespace esvr::samples
