#pragma once
/// Values that several parts of the report have.

#include <nlohmann/json.hpp>
#include <optional>

#include "esvr/coord.h"

namespace esvr::vdb2esvr {

template <class T>
[[nodiscard]] nlohmann::ordered_json orNull(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

/// The first and the last voxel of a box: x, y, z, x, y, z. Null if it is empty.
[[nodiscard]] inline nlohmann::ordered_json toJson(const Box& box) {
  if (box.empty()) return nullptr;
  return {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z};
}

}  // namespace esvr::vdb2esvr
