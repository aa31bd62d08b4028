#pragma once
/// Messages with bytes: the length of the head as uint32 in little endian, the head as JSON text,
/// and the bytes.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace esvr::view {

[[nodiscard]] std::string binaryMessage(const nlohmann::json& head, std::string_view bytes);

/// JSON as text; bytes of names that are not UTF-8 are replaced.
[[nodiscard]] std::string textOf(const nlohmann::json& content);

}  // namespace esvr::view
