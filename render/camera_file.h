#pragma once
/// Cameras as JSON objects, for the option --camera.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "esvr/camera.h"

namespace esvr::render {

/// The camera of a JSON object. Its optional keys are "eye", "center" and "up" (three numbers
/// each), "fov", "height", and "orthographic" (true or false; the default is true if "height" is
/// given).
/// \throws BadInput  it is no object, a key is unknown, or a value has the wrong form
[[nodiscard]] CameraWish cameraWish(const nlohmann::json& content);

/// Reads a file with such an object.
/// \throws BadInput  the file is missing or not JSON; as for cameraWish. The text names the file
[[nodiscard]] CameraWish readCamera(const std::filesystem::path& path);

}  // namespace esvr::render
