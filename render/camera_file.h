#pragma once
/// The option --camera: reads a camera file.

#include <filesystem>

#include "esvr/camera.h"

namespace esvr::render {

/// Reads a JSON object. Its optional keys are "eye", "center" and "up" (three numbers each), "fov",
/// "height", and "orthographic" (true or false; the default is true if "height" is given).
/// \throws BadInput  the file is missing or not JSON, a key is unknown, or a value has the wrong
///                   form
[[nodiscard]] CameraWish readCamera(const std::filesystem::path& path);

}  // namespace esvr::render
