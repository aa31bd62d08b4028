#include "render/view/desk.h"

#include <nlohmann/json.hpp>

#include "cli/failure.h"
#include "render/view/binary_message.h"
#include "render/view/camera_message.h"
#include "render/view/description.h"
#include "render/view/failed_message.h"
#include "render/view/json_members.h"

namespace esvr::view {
namespace {

std::optional<std::int64_t> idOf(const json& message) {
  const auto id = message.is_object() ? message.find("id") : message.end();
  if (id == message.end() || !id->is_number_integer()) return std::nullopt;
  return id->get<std::int64_t>();
}

}  // namespace

Desk::Desk(const Collection& collection, Studio& studio, const std::string& device)
    : collection_(collection),
      studio_(studio),
      description_(descriptionMessage(collection, device)) {}

bool Desk::receive(const std::shared_ptr<Outlet>& client, std::string_view message) {
  const json content = json::parse(message, nullptr, false);
  try {
    if (content.is_discarded()) throw BadInput("the message is not JSON");
    serve(client, content);
    return true;
  } catch (...) {
    client->answer(failedMessage(cli::currentFailure().what(), idOf(content)));
    return false;
  }
}

void Desk::serve(const std::shared_ptr<Outlet>& client, const json& message) {
  const Members members(message, "message");
  const std::string type = members.text("type").value_or("");
  if (type == "describe") {
    client->answer(description_);
  } else if (type == "draw") {
    studio_.draw(client, drawRequestOf(message));
  } else if (type == "fit") {
    client->answer(cameraMessage(collection_, message));
  } else {
    members.refuse("type", "is not known");
  }
}

}  // namespace esvr::view
