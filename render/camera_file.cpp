#include "render/camera_file.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "esvr/error.h"
#include "programs/files.h"

namespace esvr::render {
namespace {

using nlohmann::json;

Vec3 place(const json& value) {
  const bool fits =
      value.is_array() && value.size() == 3 &&
      std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number(); });
  if (!fits) throw BadInput("is no list of three numbers");
  return {value[0].get<double>(), value[1].get<double>(), value[2].get<double>()};
}

double number(const json& value) {
  if (!value.is_number()) throw BadInput("is no number");
  return value.get<double>();
}

Projection projection(const json& value) {
  if (!value.is_boolean()) throw BadInput("is neither true nor false");
  return value.get<bool>() ? Projection::kOrthographic : Projection::kPerspective;
}

void set(const std::string& key, const json& value, CameraWish& wish) {
  if (key == "eye")
    wish.eye = place(value);
  else if (key == "center")
    wish.center = place(value);
  else if (key == "up")
    wish.up = place(value);
  else if (key == "fov")
    wish.fov = number(value);
  else if (key == "height")
    wish.height = number(value);
  else if (key == "orthographic")
    wish.projection = projection(value);
  else
    throw BadInput("is none of eye, center, up, fov, height, orthographic");
}

}  // namespace

CameraWish cameraWish(const json& content) {
  if (!content.is_object()) throw BadInput("no JSON object");
  CameraWish wish;
  if (content.contains("height")) wish.projection = Projection::kOrthographic;
  for (const auto& [key, value] : content.items()) try {
      set(key, value, wish);
    } catch (const BadInput& error) {
      throw BadInput("\"" + key + "\" " + error.what());
    }
  return wish;
}

CameraWish readCamera(const std::filesystem::path& path) {
  const json content = json::parse(cli::readText(path), nullptr, false);
  try {
    return cameraWish(content);
  } catch (const BadInput& error) {
    throw BadInput(path.string() + ": " + error.what());
  }
}

}  // namespace esvr::render
