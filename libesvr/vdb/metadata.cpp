#include "vdb/metadata.h"

#include <openvdb/Grid.h>

#include <algorithm>
#include <array>
#include <map>
#include <sstream>

#include "esvr/error.h"
#include "esvr/vdb_io.h"

namespace esvr::vdb {
namespace {

MetaItem readItem(InputFile& file) {
  MetaItem item;
  item.name = file.readString();
  item.type = file.readString();
  item.value = file.readBytes(file.read<std::uint32_t>());
  if (item.name.empty()) throw BadInput("is damaged: a metadata item without a name");
  return item;
}

bool isTemporary(const MetaItem& item) { return item.type.starts_with("__"); }

/// A stream with the size and the bytes of an item, as Metadata::read expects.
std::istringstream sizedBytes(const MetaItem& item) {
  const auto size = std::uint32_t(item.value.size());
  std::string bytes(reinterpret_cast<const char*>(&size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(item.value.data()), item.value.size());
  return std::istringstream(bytes, std::ios::binary);
}

/// OpenVDB's object for an item. It has its type if OpenVDB knows the type and the number of bytes
/// is right, so that applications can access it; otherwise it holds the bytes unchanged.
openvdb::Metadata::Ptr makeMetadata(const MetaItem& item) {
  if (openvdb::Metadata::isRegisteredType(item.type)) {
    auto typed = openvdb::Metadata::createMetadata(item.type);
    auto stream = sizedBytes(item);
    typed->read(stream);
    if (stream && typed->size() == item.value.size()) return typed;
  }
  auto raw = std::make_shared<openvdb::UnknownMetadata>(item.type);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(item.value.data());
  raw->setValue({bytes, bytes + item.value.size()});
  return raw;
}

}  // namespace

std::vector<MetaItem> readMetadata(InputFile& file) {
  std::map<std::string, MetaItem> byName;
  const auto count = file.read<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    MetaItem item = readItem(file);
    if (!isTemporary(item)) byName.insert_or_assign(item.name, std::move(item));
  }
  std::vector<MetaItem> items;
  for (auto& [name, item] : byName) items.push_back(std::move(item));
  return items;
}

const MetaItem* findItem(std::span<const MetaItem> items, const std::string& name) {
  const auto it =
      std::find_if(items.begin(), items.end(), [&](const MetaItem& m) { return m.name == name; });
  return it == items.end() ? nullptr : &*it;
}

bool isFileStatistic(const MetaItem& item) {
  using openvdb::GridBase;
  const std::array names{GridBase::META_FILE_BBOX_MIN,    GridBase::META_FILE_BBOX_MAX,
                         GridBase::META_FILE_COMPRESSION, GridBase::META_FILE_MEM_BYTES,
                         GridBase::META_FILE_VOXEL_COUNT, GridBase::META_FILE_DELAYED_LOAD};
  return std::find(names.begin(), names.end(), item.name) != names.end();
}

std::vector<MetaItem> withoutFileStatistics(std::vector<MetaItem> items) {
  std::erase_if(items, isFileStatistic);
  return items;
}

void insertItems(std::span<const MetaItem> items, openvdb::MetaMap& to) {
  for (const auto& item : items) {
    to.removeMeta(item.name);
    to.insertMeta(item.name, *makeMetadata(item));
  }
}

}  // namespace esvr::vdb

namespace esvr {

MetaItem stringItem(const std::string& name, const std::string& value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(value.data());
  return {name, "string", {bytes, bytes + value.size()}};
}

std::string stringValue(std::span<const MetaItem> items, const std::string& name) {
  const auto item = std::ranges::find(items, name, &MetaItem::name);
  if (item == items.end() || item->type != "string") return {};
  return {reinterpret_cast<const char*>(item->value.data()), item->value.size()};
}

}  // namespace esvr
