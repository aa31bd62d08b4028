#include "vdb/properties.h"

#include <openvdb/math/Maps.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "core/counted.h"
#include "esvr/error.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb {
namespace {

namespace math = openvdb::math;

/// OpenVDB's object for an item. It has its type if OpenVDB knows the type and the number of bytes
/// is right, so that applications can access it; otherwise it holds the bytes unchanged.
openvdb::Metadata::Ptr makeMetadata(const MetaItem& item) {
  if (openvdb::Metadata::isRegisteredType(item.type)) {
    auto typed = openvdb::Metadata::createMetadata(item.type);
    // Metadata::read expects the size in front of the bytes.
    const auto size = std::uint32_t(item.value.size());
    std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
    bytes.append(reinterpret_cast<const char*>(item.value.data()), item.value.size());
    std::istringstream stream(bytes, std::ios::binary);
    typed->read(stream);
    if (stream && typed->size() == item.value.size()) return typed;
  }
  auto raw = std::make_shared<openvdb::UnknownMetadata>(item.type);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(item.value.data());
  raw->setValue({bytes, bytes + item.value.size()});
  return raw;
}

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

/// The map with its bytes and, where it is linear, its matrix.
Transform fromMap(const math::MapBase& map) {
  std::ostringstream stream(std::ios::binary);
  map.write(stream);
  const std::string text = stream.str();
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  Transform transform{map.type(), {bytes, bytes + text.size()}, std::nullopt};
  if (map.isLinear()) {
    const math::Mat4d matrix = map.getAffineMap()->getMat4();
    std::copy_n(matrix.asPointer(), 16, transform.affine.emplace().begin());
  }
  return transform;
}

}  // namespace

std::vector<MetaItem> readMetadata(InputFile& file) {
  std::map<std::string, MetaItem> byName;
  const auto count = file.read<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    MetaItem item;
    item.name = file.readString();
    item.type = file.readString();
    item.value = file.readBytes(file.read<std::uint32_t>());
    if (item.name.empty()) throw BadInput("is damaged: a metadata item without a name");
    const bool isTemporary = item.type.starts_with("__");
    if (!isTemporary) byName.insert_or_assign(item.name, std::move(item));
  }
  std::vector<MetaItem> items;
  for (auto& [name, item] : byName) items.push_back(std::move(item));
  return items;
}

const MetaItem* findItem(std::span<const MetaItem> items, const std::string& name) {
  const auto item = std::ranges::find(items, name, &MetaItem::name);
  return item == items.end() ? nullptr : &*item;
}

std::vector<MetaItem> withoutFileStatistics(std::vector<MetaItem> items) {
  using openvdb::GridBase;
  const std::array names{GridBase::META_FILE_BBOX_MIN,    GridBase::META_FILE_BBOX_MAX,
                         GridBase::META_FILE_COMPRESSION, GridBase::META_FILE_MEM_BYTES,
                         GridBase::META_FILE_VOXEL_COUNT, GridBase::META_FILE_DELAYED_LOAD};
  std::erase_if(items, [&](const MetaItem& item) {
    return std::ranges::find(names, item.name) != names.end();
  });
  return items;
}

void insertItems(std::span<const MetaItem> items, openvdb::MetaMap& to) {
  for (const auto& item : items) {
    to.removeMeta(item.name);
    to.insertMeta(item.name, *makeMetadata(item));
  }
}

Transform readTransform(InputFile& file) {
  const std::string mapType = file.readString();
  const auto map = createMap(mapType);
  if (isFrustum(mapType)) checkFrustum(file);
  map->read(file.stream());
  file.followStream();
  return fromMap(*map);
}

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

MetaItem stringItem(const std::string& name, const std::string& value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(value.data());
  return {name, "string", {bytes, bytes + value.size()}};
}

std::string stringValue(std::span<const MetaItem> items, const std::string& name) {
  const MetaItem* item = vdb::findItem(items, name);
  if (!item || item->type != "string") return {};
  return {reinterpret_cast<const char*>(item->value.data()), item->value.size()};
}

Transform uniformTransform(double voxelSize) {
  if (!(voxelSize > 0.0) || !std::isfinite(voxelSize))
    throw UsageError("a voxel size must be positive and finite");
  try {
    return vdb::fromMap(openvdb::math::UniformScaleMap(voxelSize));
  } catch (const openvdb::Exception& e) {  // OpenVDB treats a scale below about 1e-5 as singular
    throw UsageError("a voxel size of " + shortText(voxelSize) + ": " + e.what());
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
