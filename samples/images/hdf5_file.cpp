#include "images/hdf5_file.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "esvr/error.h"

namespace esvr::samples {
namespace {

constexpr const char* kOther = "other";
constexpr std::size_t kBitsOfByte = 8;

/// Keeps the library from printing its errors.
void keepQuiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

/// Takes the description of the innermost error.
herr_t takeReason(unsigned, const H5E_error2_t* error, void* reason) {
  if (error->desc && *error->desc) *static_cast<std::string*>(reason) = error->desc;
  return 0;
}

std::string hdf5Reason() {
  std::string reason = "unknown error";
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, takeReason, &reason);
  return reason;
}

/// A type as the name of its numbers, for example "uint16".
std::string numberName(hid_t type) {
  const auto bits = std::to_string(H5Tget_size(type) * kBitsOfByte);
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
      return (H5Tget_sign(type) == H5T_SGN_NONE ? "uint" : "int") + bits;
    case H5T_FLOAT:
      return "float" + bits;
    case H5T_ENUM:
      return "enum" + bits;  // such as truth values
    default:
      return kOther;
  }
}

std::optional<double> maximumOf(hid_t type) {
  if (H5Tget_class(type) != H5T_INTEGER) return std::nullopt;
  const double bits = double(H5Tget_precision(type));
  return std::exp2(H5Tget_sign(type) == H5T_SGN_NONE ? bits : bits - 1.0) - 1.0;
}

std::vector<std::uint64_t> axesOf(hid_t dataset) {
  const Hdf5Handle space(H5Dget_space(dataset), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.id());
  std::vector<hsize_t> lengths(std::size_t(std::max(rank, 0)));
  if (rank > 0) H5Sget_simple_extent_dims(space.id(), lengths.data(), nullptr);
  return {lengths.begin(), lengths.end()};
}

/// Adds a dataset to a list; H5Ovisit calls it for each object. Objects that cannot be opened are
/// left out, so that they do not hide the others.
herr_t addDataset(hid_t file, const char* name, const H5O_info_t* info, void* list) {
  if (info->type != H5O_TYPE_DATASET) return 0;
  const Hdf5Handle dataset(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  if (!dataset.isValid()) return 0;
  const Hdf5Handle type(H5Dget_type(dataset.id()), H5Tclose);
  if (!type.isValid()) return 0;
  static_cast<std::vector<Hdf5Dataset>*>(list)->push_back(
      {std::string("/") + name, axesOf(dataset.id()), numberName(type.id()), maximumOf(type.id())});
  return 0;
}

}  // namespace

Hdf5Handle::Hdf5Handle(Hdf5Handle&& other) noexcept
    : id_(std::exchange(other.id_, -1)), close_(other.close_) {}

Hdf5Handle& Hdf5Handle::operator=(Hdf5Handle&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

std::string textOf(const Hdf5Dataset& dataset) {
  std::string text = dataset.path + " (";
  for (std::size_t i = 0; i < dataset.axes.size(); ++i)
    text += (i ? " x " : "") + std::to_string(dataset.axes[i]);
  return text + (dataset.axes.empty() ? "" : " ") + dataset.type + ")";
}

Hdf5File::Hdf5File(std::filesystem::path path) : path_(std::move(path)) {
  keepQuiet();
  file_ = Hdf5Handle(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file_.isValid()) fail("it cannot be opened");
}

void Hdf5File::fail(const std::string& what) const {
  throw BadInput("cannot read " + path_.string() + ": " + what + ": " + hdf5Reason());
}

std::vector<Hdf5Dataset> Hdf5File::datasets() const {
  std::vector<Hdf5Dataset> list;
  if (H5Ovisit(file_.id(), H5_INDEX_NAME, H5_ITER_INC, addDataset, &list) < 0)
    fail("its datasets cannot be listed");
  return list;
}

Hdf5Handle Hdf5File::open(const Hdf5Dataset& dataset, std::size_t cacheBytes) const {
  constexpr std::size_t kSlots = 100'003;  // a prime number, as the library recommends
  const Hdf5Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  H5Pset_chunk_cache(access.id(), kSlots, cacheBytes, H5D_CHUNK_CACHE_W0_DEFAULT);
  Hdf5Handle opened(H5Dopen2(file_.id(), dataset.path.c_str(), access.id()), H5Dclose);
  if (!opened.isValid()) fail(dataset.path + " cannot be opened");
  return opened;
}

std::optional<std::array<double, 3>> elementSize(const Hdf5Handle& dataset) {
  constexpr const char* kName = "element_size_um";
  if (H5Aexists(dataset.id(), kName) <= 0) return std::nullopt;
  const Hdf5Handle attribute(H5Aopen(dataset.id(), kName, H5P_DEFAULT), H5Aclose);
  const Hdf5Handle space(H5Aget_space(attribute.id()), H5Sclose);
  std::array<double, 3> zyx{};
  if (H5Sget_simple_extent_npoints(space.id()) != hssize_t(zyx.size()) ||
      H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, zyx.data()) < 0)
    return std::nullopt;
  return std::array{zyx[2], zyx[1], zyx[0]};
}

double chunkBytesOfPlane(const Hdf5Handle& dataset, const std::vector<std::uint64_t>& axes,
                         std::size_t axis) {
  const Hdf5Handle properties(H5Dget_create_plist(dataset.id()), H5Pclose);
  if (H5Pget_layout(properties.id()) != H5D_CHUNKED) return 0.0;
  std::vector<hsize_t> chunk(axes.size(), 1);
  H5Pget_chunk(properties.id(), int(chunk.size()), chunk.data());
  const Hdf5Handle type(H5Dget_type(dataset.id()), H5Tclose);
  double bytes = double(H5Tget_size(type.id()));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const double chunks = std::ceil(double(axes[i]) / double(std::max<hsize_t>(chunk[i], 1)));
    bytes *= double(chunk[i]) * (i == axis ? 1.0 : chunks);
  }
  return bytes;
}

}  // namespace esvr::samples
