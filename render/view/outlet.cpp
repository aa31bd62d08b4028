#include "render/view/outlet.h"

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

std::string failedMessage(const std::string& text, std::optional<std::int64_t> id) {
  nlohmann::json content{{"type", "failed"}, {"text", text}};
  if (id) content["id"] = *id;
  return textOf(content);
}

}  // namespace esvr::view
