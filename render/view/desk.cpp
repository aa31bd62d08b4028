#include "render/view/desk.h"

#include <nlohmann/json.hpp>

#include "cli/failure.h"
#include "render/view/binary_message.h"
#include "render/view/camera_message.h"
#include "render/view/command_text.h"
#include "render/view/description.h"
#include "render/view/failed_message.h"
#include "render/view/histogram.h"
#include "render/view/json_members.h"
#include "render/view/png_message.h"
#include "render/view/transfer_json.h"

namespace esvr::view {
namespace {

std::optional<std::int64_t> idOf(const json& message) {
  const auto id = message.is_object() ? message.find("id") : message.end();
  if (id == message.end() || !id->is_number_integer()) return std::nullopt;
  return id->get<std::int64_t>();
}

std::string commandMessage(const Collection& collection, const json& request) {
  const Members members(request, "command");
  members.requireKnown({"type", "scene", "width", "height"});
  const auto command =
      commandOf(collection, sceneOf(members.at("scene")), sizeOf(request, "command"));
  json answer{{"type", "command"}, {"text", command.text}, {"transfer", nullptr}};
  if (command.transfer) answer["transfer"] = *command.transfer;
  return textOf(answer);
}

std::string presetMessage(const json& request) {
  const Members members(request, "preset");
  members.requireKnown({"type", "text"});
  json presets = json::array();
  for (const auto& [name, function] :
       paraViewPresets(members.text("text").value_or(""), "the preset"))
    presets.push_back({{"name", name}, {"transfer", jsonOf(function)}});
  return textOf({{"type", "preset"}, {"presets", presets}});
}

GridPlace histogramPlaceOf(const json& request) {
  const Members members(request, "histogram");
  members.requireKnown({"type", "file", "grid", "frame"});
  return placeOf(request, "histogram");
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
  } else if (type == "png") {
    drawPng(client, pngRequestOf(message));
  } else if (type == "histogram") {
    countValues(client, histogramPlaceOf(message));
  } else if (type == "command") {
    client->answer(commandMessage(collection_, message));
  } else if (type == "preset") {
    client->answer(presetMessage(message));
  } else {
    members.refuse("type", "is not known");
  }
}

void Desk::drawPng(const std::shared_ptr<Outlet>& client, PictureRequest request) {
  studio_.add(client, [this, request = std::move(request)](Drawables& drawables, Outlet& to,
                                                           const CancelToken& gone) {
    try {
      studio_.makeRoomFor(request);
      to.deliver(pngMessage(collection_, drawables, request, gone));
    } catch (const Cancelled&) {
      throw;
    } catch (...) {
      to.answer(failedMessage(cli::currentFailure().what(), request.id));
    }
  });
}

void Desk::countValues(const std::shared_ptr<Outlet>& client, const GridPlace& place) {
  const ValueRange range = collection_.gridAt(place).outline.front().data;
  studio_.add(client, [place, range](Drawables& drawables, Outlet& to, const CancelToken&) {
    const auto drawable = drawables.get(place);
    const auto count = [&](const SparseVolume& volume) { return histogramOf(volume, range); };
    to.answer(histogramMessage(
        place, range,
        drawable ? drawable->withVoxels(count) : std::vector<std::uint64_t>(kHistogramBins)));
  });
}

}  // namespace esvr::view
