#include "render/view/requests.h"

#include "render/view/json_members.h"

namespace esvr::view {
namespace {

constexpr std::int64_t kLargestId = std::int64_t{1} << 53;  // JavaScript's whole numbers

int sideOf(const Members& members, const char* name) {
  const auto side = members.whole(name, 1, kMaxPictureSide);
  if (!side) members.refuse(name, "is missing");
  return int(*side);
}

PictureRequest pictureOf(const Members& members) {
  const auto id = members.whole("id", 0, kLargestId);
  if (!id) members.refuse("id", "is missing");
  return {*id, {sideOf(members, "width"), sideOf(members, "height")}, sceneOf(members.at("scene"))};
}

}  // namespace

Resolution sizeOf(const json& content, const std::string& name) {
  const Members members(content, name);
  return {sideOf(members, "width"), sideOf(members, "height")};
}

DrawRequest drawRequestOf(const json& content) {
  const Members members(content, "draw");
  members.requireKnown({"type", "id", "width", "height", "quality", "moving", "scene"});
  DrawRequest request;
  request.quality = members.number("quality", 0.0, 1.0).value_or(request.quality);
  request.moving = members.flag("moving").value_or(request.moving);
  request.picture = pictureOf(members);
  return request;
}

PictureRequest pngRequestOf(const json& content) {
  const Members members(content, "png");
  members.requireKnown({"type", "id", "width", "height", "scene"});
  return pictureOf(members);
}

}  // namespace esvr::view
