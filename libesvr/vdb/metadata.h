#pragma once
/// VDB metadata as bytes: reads it with checked sizes, looks up items, and passes it to OpenVDB.

#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "esvr/grid_descriptor.h"
#include "vdb/input_file.h"
#include "vdb/versions.h"

#include <openvdb/MetaMap.h>

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

/// True for statistics that a writer makes anew for each grid (file_voxel_count, ...).
bool isFileStatistic(const MetaItem& item);
std::vector<MetaItem> withoutFileStatistics(std::vector<MetaItem> items);

/// Inserts items such that OpenVDB writes the same bytes again.
void insertItems(std::span<const MetaItem> items, openvdb::MetaMap& to);

}  // namespace esvr::vdb
