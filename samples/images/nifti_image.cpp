#include <nifti2_io.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "esvr/error.h"
#include "images/element_type.h"
#include "images/image_source.h"
#include "images/zipped_file.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;

/// The value of nifti_image::byteorder for big-endian files. The library does not publish its name.
constexpr int kBigEndian = 2;

struct HeaderDeleter {
  void operator()(nifti_image* header) const { nifti_image_free(header); }
};
using HeaderPointer = std::unique_ptr<nifti_image, HeaderDeleter>;

struct MemoryDeleter {
  void operator()(void* memory) const { std::free(memory); }
};

template <class Header>
void requireUsable(const fs::path& path, const Header& header) {
  if (header.dim[0] < 1 || header.dim[0] > 7 || header.dim[1] < 1)
    throw BadInput("cannot read " + path.string() + ": its sizes are damaged");
  if (!nifti_is_valid_datatype(header.datatype))
    throw BadInput("cannot read " + path.string() + ": it has values of the unknown type " +
                   std::to_string(header.datatype));
}

/// Refuses what the library would print a message about.
void requireUsable(const fs::path& path) {
  int version = 0, swapped = 0;  // version 0 is that of ANALYZE 7.5, which has the header of 1
  const std::unique_ptr<void, MemoryDeleter> raw(nifti_read_header(path.c_str(), &version, 0));
  if (!raw || version < 0 || version > 2) return;
  // nifti_read_header leaves the byte order of the file.
  const std::unique_ptr<void, MemoryDeleter> header(
      version == 2 ? static_cast<void*>(nifti_read_n2_hdr(path.c_str(), &swapped, 0))
                   : nifti_read_n1_hdr(path.c_str(), &swapped, 0));
  if (header && version == 2) requireUsable(path, *static_cast<nifti_2_header*>(header.get()));
  if (header && version < 2) requireUsable(path, *static_cast<nifti_1_header*>(header.get()));
}

HeaderPointer readHeader(const fs::path& path) {
  nifti_set_debug_level(0);  // the library is not to print
  requireUsable(path);
  HeaderPointer header(nifti_image_read(path.c_str(), 0));
  if (!header)
    throw BadInput("cannot read " + path.string() +
                   ": it is no NIfTI image, or its name does not end in .nii, .nii.gz or .hdr");
  return header;
}

/// The numbers of a voxel.
struct Voxel {
  const ElementType* type = nullptr;
  std::size_t samples = 1;
};

Voxel voxelOf(const nifti_image& header, const fs::path& path) {
  switch (header.datatype) {
    case NIFTI_TYPE_UINT8:
      return {&elementType("uint8")};
    case NIFTI_TYPE_INT8:
      return {&elementType("int8")};
    case NIFTI_TYPE_UINT16:
      return {&elementType("uint16")};
    case NIFTI_TYPE_INT16:
      return {&elementType("int16")};
    case NIFTI_TYPE_UINT32:
      return {&elementType("uint32")};
    case NIFTI_TYPE_INT32:
      return {&elementType("int32")};
    case NIFTI_TYPE_UINT64:
      return {&elementType("uint64")};
    case NIFTI_TYPE_INT64:
      return {&elementType("int64")};
    case NIFTI_TYPE_FLOAT32:
      return {&elementType("float32")};
    case NIFTI_TYPE_FLOAT64:
      return {&elementType("float64")};
    case NIFTI_TYPE_COMPLEX64:
      return {&elementType("float32"), 2};
    case NIFTI_TYPE_COMPLEX128:
      return {&elementType("float64"), 2};
    case NIFTI_TYPE_RGB24:
      return {&elementType("uint8"), 3};
    case NIFTI_TYPE_RGBA32:
      return {&elementType("uint8"), 4};
    default:
      throw BadInput(path.string() + " has values of type " +
                     nifti_datatype_string(header.datatype) + ", which cannot be read");
  }
}

/// The number of volumes: times, and components that are stored as volumes.
std::uint64_t volumesOf(const nifti_image& header, const fs::path& path) {
  constexpr int kFirst = 4, kLast = 7;
  double volumes = 1.0;
  for (int axis = kFirst; axis <= kLast && axis <= header.dim[0]; ++axis)
    volumes *= double(std::max<std::int64_t>(header.dim[axis], 1));
  constexpr double kMost = 1e9;
  if (volumes > kMost) throw BadInput(path.string() + " has more than 10^9 volumes");
  return std::uint64_t(volumes);
}

std::uint64_t lengthOf(const nifti_image& header, int axis) {
  return axis <= header.dim[0] ? std::uint64_t(std::max<std::int64_t>(header.dim[axis], 0)) : 1;
}

/// The transposed matrix, because that of a NIfTI image is for column vectors.
std::array<double, 16> transposed(const nifti_dmat44& matrix) {
  std::array<double, 16> result{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      result[column * 4 + row] = matrix.m[row][column];
  return result;
}

class NiftiImage : public ImageSource {
 public:
  NiftiImage(const fs::path& path, const ImageChoice& choice)
      : path_(path),
        header_(readHeader(path)),
        voxel_(voxelOf(*header_, path)),
        size_(checkedSize(path,
                          {lengthOf(*header_, 1), lengthOf(*header_, 2), lengthOf(*header_, 3)})),
        component_(chosenComponent(path, choice, voxel_.samples * volumesOf(*header_, path))),
        file_(header_->iname ? header_->iname : path) {
    refuseDataset(path, choice);
    requireSlabMemory(path, size_, voxelBytes());
  }

  [[nodiscard]] Coord size() const override { return size_; }
  [[nodiscard]] std::optional<double> typeMaximum() const override {
    return isScaled() ? std::nullopt : voxel_.type->maximum;
  }
  [[nodiscard]] std::array<double, 16> indexToWorld() const override {
    // Where no form is given, the library makes qto_xyz of the spacings.
    return transposed(header_->sform_code > 0 ? header_->sto_xyz : header_->qto_xyz);
  }

  void read(const Slab& slab, std::span<float> out) override {
    bytes_.resize(out.size() * voxelBytes());
    if (file_.read(placeOf(slab.firstZ), bytes_) != bytes_.size())
      throw BadInput(path_.string() + ": the data ends before slice " +
                     std::to_string(slab.firstZ + slab.slices));
    voxel_.type->decode({.bytes = bytes_,
                         .bigEndian = header_->byteorder == kBigEndian,
                         .first = component_ % voxel_.samples,
                         .step = voxel_.samples},
                        out);
    if (!isScaled()) return;
    for (float& value : out) value = float(double(value) * header_->scl_slope + header_->scl_inter);
  }

 private:
  /// Colors are not scaled, and a slope of 0 means that nothing is.
  [[nodiscard]] bool isScaled() const {
    const double slope = header_->scl_slope, offset = header_->scl_inter;
    const bool isColor =
        header_->datatype == NIFTI_TYPE_RGB24 || header_->datatype == NIFTI_TYPE_RGBA32;
    return !isColor && std::isfinite(slope) && std::isfinite(offset) && slope != 0.0 &&
           (slope != 1.0 || offset != 0.0);
  }

  [[nodiscard]] std::size_t voxelBytes() const { return voxel_.type->bytes * voxel_.samples; }
  [[nodiscard]] std::uint64_t sliceBytes() const {
    return std::uint64_t(size_.x) * std::uint64_t(size_.y) * voxelBytes();
  }
  [[nodiscard]] std::uint64_t placeOf(std::int32_t z) const {
    const std::uint64_t slice =
        component_ / voxel_.samples * std::uint64_t(size_.z) + std::uint64_t(z);
    const auto offset = std::uint64_t(std::max<std::int64_t>(header_->iname_offset, 0));
    return double(slice) * double(sliceBytes()) + double(offset) < 0x1p62
               ? offset + slice * sliceBytes()
               : std::numeric_limits<std::uint64_t>::max();
  }

  fs::path path_;
  HeaderPointer header_;
  Voxel voxel_;
  Coord size_;
  std::size_t component_;
  ZippedFile file_;
  std::vector<std::byte> bytes_;
};

}  // namespace

std::unique_ptr<ImageSource> openNifti(const fs::path& path, const ImageChoice& choice) {
  return std::make_unique<NiftiImage>(path, choice);
}

}  // namespace esvr::samples
