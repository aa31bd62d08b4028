#pragma once
/// The properties of files and grids that are kept as bytes: metadata and index-to-world maps. They
/// are read with checked sizes, and passed to OpenVDB such that it writes the same bytes again.

#include "vdb/open_vdb.h"

#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "esvr/grid.h"
#include "vdb/files.h"

namespace esvr::vdb {

/// Reads a block of metadata, sorted by name as in OpenVDB. Items that OpenVDB calls temporary
/// (their type begins with "__") are left out. \throws BadInput  the block is damaged
std::vector<MetaItem> readMetadata(InputFile& file);

const MetaItem* findItem(std::span<const MetaItem> items, const std::string& name);
/// The value of an item with this type and the size of T; nothing if there is none.
template <class T>
std::optional<T> fixedValue(std::span<const MetaItem> items, const std::string& name,
                            const std::string& type) {
  static_assert(std::is_trivially_copyable_v<T>);
  const MetaItem* item = findItem(items, name);
  if (!item || item->type != type || item->value.size() != sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, item->value.data(), sizeof value);
  return value;
}

/// The items without statistics that a writer makes anew for each grid (file_voxel_count, ...).
std::vector<MetaItem> withoutFileStatistics(std::vector<MetaItem> items);

/// Inserts items such that OpenVDB writes the same bytes again.
void insertItems(std::span<const MetaItem> items, openvdb::MetaMap& to);

/// Reads the transform at the position of the file. The stream must know the file's version.
/// \throws BadInput  the transform is damaged, or OpenVDB does not know its map
Transform readTransform(InputFile& file);

/// The simplest of OpenVDB's maps that equals an affine map.
/// \throws openvdb::ArithmeticError  the matrix is singular or not affine
Transform fromMatrix(const openvdb::math::Mat4d& matrix);

/// The map as it was read, without OpenVDB's simplification.
/// \throws BadInput  the bytes are not such a map
openvdb::math::Transform::Ptr toOpenVdb(const Transform& transform);

}  // namespace esvr::vdb
