#pragma once
/// --camera.

#include <filesystem>

#include "esvr/camera.h"

namespace esvr::render {

/// A JSON object with any of "eye", "center", "up" (three numbers each), "fov" or "height", and
/// "orthographic" (true or false; true where there is a height).
/// \throws BadInput  missing, not JSON, another key (lists those there are), not so many numbers
[[nodiscard]] CameraWish readCamera(const std::filesystem::path& path);

}  // namespace esvr::render
