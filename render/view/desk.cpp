#include "render/view/desk.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "programs/help_text.h"
#include "programs/run_main.h"
#include "render/look.h"
#include "render/png_file.h"
#include "render/view/command_text.h"
#include "render/view/painting.h"

namespace esvr::view {

// The answer to "describe": what the server shows.

namespace {

/// Lengths of the grid's axes in the world; null for a frustum.
json voxelSizeOf(const Transform& transform) {
  if (!transform.affine) return nullptr;
  const auto& m = *transform.affine;
  json sizes = json::array();
  for (std::size_t row = 0; row < 12; row += 4)
    sizes.push_back(std::hypot(m[row], m[row + 1], m[row + 2]));
  return sizes;
}

/// The edges of a voxel in a camera's space (esvr/camera.h); null for a frustum.
json edgesOf(const Transform& transform) {
  const auto shape = voxelShape(transform.affine);
  return shape ? json(shape->edges) : json(nullptr);
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
          {"edges", edgesOf(scene.transform)},
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

std::string descriptionMessage(const Collection& collection, const std::string& device) {
  json files = json::array(), maps, curves;
  for (const ShownFile& file : collection.files()) files.push_back(fileJson(file));
  for (const std::string& name : builtInColorMaps()) maps[name] = jsonOf(builtInColorMap(name));
  for (const std::string& name : builtInOpacities()) curves[name] = jsonOf(builtInOpacity(name));
  return textOf({{"type", "description"},
                 {"program", std::string(kProgram) + " " + cli::programVersion()},
                 {"device", device},
                 {"files", files},
                 {"colormaps", maps},
                 {"opacities", curves}});
}

}  // namespace

// Answers about one grid.

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

/// The answer to "fit": a camera that sees all of a grid, from the side that "view" names.
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

/// The part of the range in which a value counts.
class Bins {
 public:
  explicit Bins(ValueRange range)
      : low_(range.min),
        perUnit_(range.max > range.min ? double(kHistogramBins) / (double(range.max) - range.min)
                                       : 0.0) {}
  [[nodiscard]] std::size_t at(float value) const {
    const double place = (double(value) - low_) * perUnit_;
    return std::size_t(std::clamp(place, 0.0, double(kHistogramBins - 1)));
  }

 private:
  double low_, perUnit_;
};

}  // namespace

std::vector<std::uint64_t> histogramOf(const SparseVolume& volume, ValueRange range) {
  const Bins bins(range);
  std::vector<std::uint64_t> counts(kHistogramBins);
  for (std::size_t brick = 0; brick < volume.brickCount(); ++brick) {
    const std::span<const float> values = volume.brickValues(brick);
    for (int offset = 0; offset < kBrickVoxels; ++offset)
      if (volume.active[brick].test(offset)) ++counts[bins.at(values[std::size_t(offset)])];
  }
  return counts;
}

std::string histogramMessage(const GridPlace& place, ValueRange range,
                             const std::vector<std::uint64_t>& counts) {
  json content{{"type", "histogram"},
               {"file", place.file},
               {"grid", place.grid},
               {"frame", nullptr},
               {"histogram", {{"low", range.min}, {"high", range.max}, {"counts", counts}}}};
  if (place.frame) content["frame"] = *place.frame;
  return textOf(content);
}

// Answers about a scene or a text.

namespace {

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

/// Draws the answer to "png": the file that esvr-render writes for the scene, with the command in
/// its metadata.
std::string pngMessage(const Collection& collection, Drawables& drawables,
                       const PictureRequest& request, const CancelToken& cancel) {
  const SceneWish& scene = request.scene;
  Painting painting({collection, drawables, scene, request.size, &cancel});
  painting.complete();
  const render::PngText text{std::string(render::kProgram) + " " + cli::programVersion(),
                             commandOf(collection, scene, request.size).text};
  const auto bytes =
      render::encodePng(painting.picture(), {scene.options.background, scene.options.bits}, text);
  return binaryMessage({{"type", "png"}, {"id", request.id}},
                       {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

// The desk.

namespace {

std::optional<std::int64_t> idOf(const json& message) {
  const auto id = message.is_object() ? message.find("id") : message.end();
  if (id == message.end() || !id->is_number_integer()) return std::nullopt;
  return id->get<std::int64_t>();
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
