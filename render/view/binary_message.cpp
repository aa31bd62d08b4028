#include "render/view/binary_message.h"

#include <cstdint>
#include <nlohmann/json.hpp>

namespace esvr::view {

std::string textOf(const nlohmann::json& content) {
  return content.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string binaryMessage(const nlohmann::json& head, std::string_view bytes) {
  const std::string text = textOf(head);
  std::string message;
  message.reserve(sizeof(std::uint32_t) + text.size() + bytes.size());
  for (unsigned shift = 0; shift < 32; shift += 8) message += char((text.size() >> shift) & 0xffu);
  return message.append(text).append(bytes);
}

}  // namespace esvr::view
