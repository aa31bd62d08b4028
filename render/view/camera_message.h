#pragma once
/// The answer to "fit": a camera that sees all of a grid.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "render/view/collection.h"

namespace esvr::view {

/// \param request  with "file", "grid" and "frame" as in a scene, "width", "height", "view" (one of
///                 default, +x, -x, +y, -y, +z, -z: the side from which the camera looks) and
///                 "orthographic"
/// \throws BadInput  a member is wrong
[[nodiscard]] std::string cameraMessage(const Collection& collection,
                                        const nlohmann::json& request);

}  // namespace esvr::view
