#include <algorithm>

#include "esvr/vdb_io.h"

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
