#include "render/view/camera_message.h"

#include <optional>

#include "render/view/binary_message.h"
#include "render/view/json_members.h"
#include "render/view/requests.h"
#include "render/view/scene_json.h"

namespace esvr::view {
namespace {

/// The direction from the middle to the eye; nothing for the usual view.
std::optional<Vec3> directionIn(const Members& members) {
  return members
      .choice<std::optional<Vec3>>("view", {{"default", std::nullopt},
                                            {"+x", Vec3{1, 0, 0}},
                                            {"-x", Vec3{-1, 0, 0}},
                                            {"+y", Vec3{0, 1, 0}},
                                            {"-y", Vec3{0, -1, 0}},
                                            {"+z", Vec3{0, 0, 1}},
                                            {"-z", Vec3{0, 0, -1}}})
      .value_or(std::nullopt);
}

}  // namespace

std::string cameraMessage(const Collection& collection, const json& request) {
  const Members members(request, "fit");
  members.requireKnown(
      {"type", "file", "grid", "frame", "width", "height", "view", "orthographic"});
  const render::Scene& scene = collection.gridAt(placeOf(request, "fit")).outline.front();
  CameraWish wish;
  if (members.flag("orthographic").value_or(false)) wish.projection = Projection::kOrthographic;
  wish.direction = directionIn(members);
  wish.voxel = voxelShape(scene.transform.affine).value_or(VoxelShape{});
  return textOf(
      {{"type", "camera"}, {"camera", jsonOf(fitCamera(scene.box, wish, sizeOf(request, "fit")))}});
}

}  // namespace esvr::view
