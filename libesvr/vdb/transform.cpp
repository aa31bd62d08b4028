#include "vdb/transform.h"

#include <openvdb/math/Maps.h>

#include <cmath>
#include <span>
#include <sstream>

#include "esvr/error.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb {
namespace {

namespace math = openvdb::math;

/// The bytes of a frustum before the name of its second map: a box, a taper and a depth.
constexpr std::uint64_t kFrustumHead = 8 * sizeof(double);

bool isFrustum(const std::string& mapType) {
  return mapType == math::NonlinearFrustumMap::mapType();
}

math::MapBase::Ptr createMap(const std::string& mapType) {
  initializeOpenVdb();
  if (!math::MapRegistry::isRegistered(mapType))
    throw BadInput("has a transform of unknown type \"" + mapType + "\"");
  return math::MapRegistry::createMap(mapType);
}

/// OpenVDB does not check the length of the second map's name, and reads a frustum within a frustum
/// by recursion. Either could crash the process on a damaged file.
void checkFrustum(InputFile& file) {
  const auto start = file.position();
  file.skip(kFrustumHead);
  if (isFrustum(file.readString())) throw BadInput("is damaged: a frustum within a frustum");
  file.seek(start);
}

std::vector<std::byte> serialised(const math::MapBase& map) {
  std::ostringstream stream(std::ios::binary);
  map.write(stream);
  const std::string text = stream.str();
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  return {bytes, bytes + text.size()};
}

std::optional<std::array<double, 16>> affineOf(const math::MapBase& map) {
  if (!map.isLinear()) return std::nullopt;
  const math::Mat4d matrix = map.getAffineMap()->getMat4();
  std::array<double, 16> affine;
  std::copy_n(matrix.asPointer(), affine.size(), affine.begin());
  return affine;
}

}  // namespace

Transform readTransform(InputFile& file) {
  const std::string mapType = file.readString();
  const auto map = createMap(mapType);
  if (isFrustum(mapType)) checkFrustum(file);
  map->read(file.stream());
  file.followStream();
  return fromMap(*map);
}

Transform fromMap(const math::MapBase& map) { return {map.type(), serialised(map), affineOf(map)}; }

Transform fromMatrix(const math::Mat4d& matrix) {
  const math::AffineMap affine(matrix);
  // OpenVDB's simplification may round, because it finds the scale of a translated map by
  // subtraction.
  const auto simple = math::Transform::createLinearTransform(matrix)->baseMap();
  return simple->getAffineMap()->getMat4() == matrix ? fromMap(*simple) : fromMap(affine);
}

math::Transform::Ptr toOpenVdb(const Transform& transform) {
  // Transform's constructor replaces a linear map by the simplest equal one; its read() does not.
  createMap(transform.mapType);
  std::stringstream stream(std::ios::in | std::ios::out | std::ios::binary);
  openvdb::writeString(stream, transform.mapType);
  stream.write(reinterpret_cast<const char*>(transform.map.data()),
               std::streamsize(transform.map.size()));
  stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  openvdb::io::setCurrentVersion(stream);
  auto result = math::Transform::createLinearTransform();
  try {
    if (isFrustum(transform.mapType)) {
      InputFile map(std::span(transform.map));
      checkFrustum(map);
    }
    const auto bytes = std::size_t(stream.tellp());
    result->read(stream);
    if (std::size_t(stream.tellg()) != bytes) throw BadInput("bytes are left");
  } catch (const std::exception&) {
    throw BadInput("the transform is damaged: " + std::to_string(transform.map.size()) +
                   " bytes are not a map of type " + transform.mapType);
  }
  return result;
}

}  // namespace esvr::vdb

namespace esvr {

Transform uniformTransform(double voxelSize) {
  if (!(voxelSize > 0.0) || !std::isfinite(voxelSize))
    throw UsageError("a voxel size must be positive and finite");
  try {
    return vdb::fromMap(openvdb::math::UniformScaleMap(voxelSize));
  } catch (const openvdb::Exception& e) {  // OpenVDB treats a scale below about 1e-5 as singular
    throw UsageError("a voxel size of " + std::to_string(voxelSize) + ": " + e.what());
  }
}

Transform affineTransform(const std::array<double, 16>& matrix) {
  for (const double element : matrix)
    if (!std::isfinite(element)) throw UsageError("a transform's matrix must be finite");
  try {
    return vdb::fromMatrix(openvdb::math::Mat4d(matrix.data()));
  } catch (const openvdb::Exception& e) {
    throw UsageError(std::string("not an invertible affine transform: ") + e.what());
  }
}

}  // namespace esvr
