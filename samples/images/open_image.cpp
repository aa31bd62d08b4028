#include "images/open_image.h"

#include <string>

#include "esvr/error.h"
#include "images/image_format.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

/// The format of all files.
ImageFormat commonFormat(const std::vector<fs::path>& paths) {
  const ImageFormat format = imageFormat(paths.front());
  if (paths.size() == 1) return format;
  for (const fs::path& path : paths)
    if (imageFormat(path) != ImageFormat::kTiff)
      throw UsageError("only TIFF images may be given as several files, and " + path.string() +
                       " is none");
  return format;
}

std::unique_ptr<ImageSource> openRawImage(const ImageRequest& request) {
  const fs::path& path = request.paths.front();
  if (!request.raw)
    throw UsageError(path.string() +
                     " is no NRRD, TIFF, NIfTI, VTI or HDF5 image; a RAW image needs --dims and "
                     "--type");
  refuseDataset(path, request.choice);
  (void)chosenComponent(path, request.choice, 1);
  return openRaw(path, *request.raw);
}

std::unique_ptr<ImageSource> openNrrdImage(const ImageRequest& request) {
  const fs::path& path = request.paths.front();
  refuseDataset(path, request.choice);
  (void)chosenComponent(path, request.choice, 1);
  return openNrrd(path);
}

}  // namespace

std::unique_ptr<ImageSource> openImage(const ImageRequest& request) {
  const ImageFormat format = commonFormat(request.paths);
  const fs::path& path = request.paths.front();
  if (format == ImageFormat::kRaw) return openRawImage(request);
  requireBuilt(format, path);
  // The functions of a library that is missing are not there, so that they must not be called.
  if constexpr (ESVR_HAS_TIFF)
    if (format == ImageFormat::kTiff) return openTiff(request.paths, request.choice);
  if constexpr (ESVR_HAS_NIFTI)
    if (format == ImageFormat::kNifti) return openNifti(path, request.choice);
  if constexpr (ESVR_HAS_VTI)
    if (format == ImageFormat::kVti) return openVti(path, request.choice);
  if constexpr (ESVR_HAS_HDF5)
    if (format == ImageFormat::kHdf5) return openHdf5(path, request.choice);
  return openNrrdImage(request);
}

}  // namespace esvr::samples
