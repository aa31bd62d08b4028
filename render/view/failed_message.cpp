#include "render/view/failed_message.h"

#include <nlohmann/json.hpp>

#include "render/view/binary_message.h"

namespace esvr::view {

std::string failedMessage(const std::string& text, std::optional<std::int64_t> id) {
  nlohmann::json content{{"type", "failed"}, {"text", text}};
  if (id) content["id"] = *id;
  return textOf(content);
}

}  // namespace esvr::view
