#pragma once
/// What clients ask the studio for.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "esvr/camera.h"
#include "render/view/scene_json.h"

namespace esvr::view {

/// The largest side of a picture, in pixels.
inline constexpr int kMaxPictureSide = 4096;

struct PictureRequest {
  std::int64_t id = 0;  ///< number that the client gave it
  Resolution size;
  SceneWish scene;
};

struct DrawRequest {
  PictureRequest picture;
  double quality = 0.85;  ///< of the JPEG, 0 to 1
  /// The user drags: one picture within the time budget is enough. Otherwise the picture is refined
  /// until it is complete.
  bool moving = false;
};

/// Reads the members "id", "width", "height" and "scene", and for a draw request also "quality" and
/// "moving".
/// \throws BadInput, UsageError  a member is missing, unknown or wrong
[[nodiscard]] DrawRequest drawRequestOf(const nlohmann::json& content);
[[nodiscard]] PictureRequest pngRequestOf(const nlohmann::json& content);

/// Reads the members "width" and "height" of an object.
[[nodiscard]] Resolution sizeOf(const nlohmann::json& content, const std::string& name);

}  // namespace esvr::view
