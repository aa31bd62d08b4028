#include "render/view/description.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/version_text.h"
#include "render/render_options.h"
#include "render/view/binary_message.h"
#include "render/view/options.h"
#include "render/view/transfer_json.h"

namespace esvr::view {
namespace {

using nlohmann::json;

/// Lengths of the grid's axes in the world; null for a frustum.
json voxelSizeOf(const Transform& transform) {
  if (!transform.affine) return nullptr;
  const auto& m = *transform.affine;
  json sizes = json::array();
  for (std::size_t row = 0; row < 12; row += 4)
    sizes.push_back(std::hypot(m[row], m[row + 1], m[row + 2]));
  return sizes;
}

/// The look that esvr-render gives the grid without options.
json usualLook(const ShownGrid& grid) {
  const TransferFunction f = render::renderOptions({}, grid.outline).transfer;
  json look = jsonOf(f);
  look["range"] = {f.opacity.front().x, f.opacity.back().x};
  return look;
}

json gridJson(const ShownGrid& grid) {
  const render::Scene& scene = grid.outline.front();
  const Box& box = scene.box;
  return {{"name", grid.name},
          {"kind", grid.kind},
          {"class", grid.gridClass},
          {"unit", scene.unit},
          {"ellipsoids", grid.ellipsoids},
          {"bytes", grid.bytes},
          {"activeVoxels", grid.activeVoxels},
          {"background", scene.background},
          {"box", {{box.min.x, box.min.y, box.min.z}, {box.max.x, box.max.y, box.max.z}}},
          {"voxelSize", voxelSizeOf(scene.transform)},
          {"range", {scene.data.min, scene.data.max}},
          {"histogram", nullptr},
          {"defaultLook", usualLook(grid)}};
}

json fileJson(const ShownFile& file) {
  json grids = json::array();
  for (const ShownGrid& grid : file.grids) grids.push_back(gridJson(grid));
  return {{"name", file.path.filename().string()},
          {"bytes", file.bytes},
          {"frames", file.frames},
          {"grids", grids}};
}

json builtInMaps() {
  json maps;
  for (const std::string& name : builtInColorMaps()) maps[name] = jsonOf(builtInColorMap(name));
  return maps;
}

json builtInCurves() {
  json curves;
  for (const std::string& name : builtInOpacities()) curves[name] = jsonOf(builtInOpacity(name));
  return curves;
}

}  // namespace

std::string descriptionMessage(const Collection& collection, const std::string& device) {
  json files = json::array();
  for (const ShownFile& file : collection.files()) files.push_back(fileJson(file));
  return textOf({{"type", "description"},
                 {"program", std::string(kProgram) + " " + cli::programVersion()},
                 {"device", device},
                 {"files", files},
                 {"colormaps", builtInMaps()},
                 {"opacities", builtInCurves()}});
}

}  // namespace esvr::view
