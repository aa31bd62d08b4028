#include "render/view/desk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "programs/command_line.h"
#include "programs/run_main.h"
#include "render/image_files.h"
#include "render/look.h"
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
  const render::PictureText text{std::string(render::kProgram) + " " + cli::programVersion(),
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

// ---- Command lines

// Names of transfer functions.

namespace {

/// Rounding of colors and places in clients.
constexpr double kTolerance = 1e-9;

bool near(double a, double b, double scale = 1.0) { return std::abs(a - b) <= kTolerance * scale; }

bool sameColors(const ColorMap& a, const ColorMap& b, double extent) {
  const auto same = [&](const ColorPoint& p, const ColorPoint& q) {
    return near(p.x, q.x, extent) && near(p.color.r, q.color.r) && near(p.color.g, q.color.g) &&
           near(p.color.b, q.color.b);
  };
  return a.space == b.space &&
         std::equal(a.points.begin(), a.points.end(), b.points.begin(), b.points.end(), same);
}

bool sameCurve(const OpacityCurve& a, const OpacityCurve& b, double extent) {
  const auto same = [&](const OpacityPoint& p, const OpacityPoint& q) {
    return near(p.x, q.x, extent) && near(p.opacity, q.opacity) && near(p.midpoint, q.midpoint) &&
           near(p.sharpness, q.sharpness);
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

}  // namespace

std::optional<LookNames> namesOf(const TransferFunction& f) {
  // Options give the range as float.
  const ValueRange range{float(f.opacity.front().x), float(f.opacity.back().x)};
  const double extent = std::max({std::abs(f.opacity.front().x), std::abs(f.opacity.back().x)});
  const auto over = [&](const ColorMap& map, const OpacityCurve& curve) {
    return rescaled({map, curve}, range);
  };
  for (const std::string& colors : builtInColorMaps())
    for (const std::string& opacity : builtInOpacities()) {
      const TransferFunction known = over(builtInColorMap(colors), builtInOpacity(opacity));
      if (sameColors(known.colors, f.colors, extent) && sameCurve(known.opacity, f.opacity, extent))
        return LookNames{colors, opacity, range};
    }
  return std::nullopt;
}

// The words of a command.

namespace {

std::string listText(std::initializer_list<double> numbers) {
  std::string text;
  for (const double v : numbers) text += (text.empty() ? "" : ",") + cli::exactNumber(v);
  return text;
}
std::string listText(const Vec3& v) { return listText({v[0], v[1], v[2]}); }

/// Words of a command line, which begin with a space each.
class Words {
 public:
  explicit Words(std::string text) : text_(std::move(text)) {}
  void add(const std::string& word) { text_ += " " + cli::shellWord(word); }
  /// The value is joined by '=', because it may begin with a minus.
  void add(const char* option, const std::string& value) { add(std::string(option) + "=" + value); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

void addInput(const Collection& collection, const GridPlace& place, Words& to) {
  const ShownFile& file = collection.fileAt(place);
  const auto frame = collection.frameAt(place);
  to.add(file.path.string());
  to.add(frame ? "picture.####.png" : "picture.png");
  if (frame) to.add("--frames", std::to_string(*frame));
  if (file.grids.size() > 1 || place.grid > 0) to.add("--grid", collection.gridAt(place).name);
}

void addCamera(const Camera& camera, Words& to) {
  to.add("--eye", listText(camera.eye));
  to.add("--center", listText(camera.center));
  to.add("--up", listText(camera.up));
  if (camera.projection == Projection::kPerspective)
    return to.add("--fov", cli::exactNumber(camera.fov));
  to.add("--orthographic");
  to.add("--height", cli::exactNumber(camera.height));
}

/// Adds the transfer function. \return the text of a file if options cannot say it
std::optional<std::string> addTransfer(const TransferFunction& f, Words& to) {
  if (const auto names = namesOf(f)) {
    to.add("--colors", names->colors);
    to.add("--opacity", names->opacity);
    to.add("--range", listText({names->range.min, names->range.max}));
    return std::nullopt;
  }
  to.add("--tf", kTransferFile);
  to.add("--range", "own");
  return paraViewPreset(f, "esvr-view");
}

void addClip(const SceneWish& scene, Words& to) {
  constexpr std::array kAxes{"x=", "y=", "z="};
  if (scene.sliceAxis)
    return to.add("--slice", kAxes[*scene.sliceAxis] + cli::exactNumber(*scene.slicePlace));
  if (const auto& clip = scene.options.clip)
    to.add("--clip", listText(clip->low) + "," + listText(clip->high));
}

/// Adds the options of the rays that differ from the defaults of esvr-render.
void addRays(const SceneWish& scene, Words& to) {
  const render::Options& o = scene.options;
  const render::Options usual;
  const bool slice = scene.sliceAxis.has_value();
  if (o.opacityLength != usual.opacityLength)
    to.add("--opacity-length", cli::exactNumber(o.opacityLength));
  if (o.step != usual.step) to.add("--step", cli::exactNumber(o.step));
  if (o.mode != usual.mode)
    to.add("--mode", o.mode == RenderMode::kMaximum ? "maximum" : "average");
  const bool post = o.classification == Classification::kPost;
  if (post != slice) to.add("--classification", post ? "post" : "pre");
  const bool off = o.lod == LevelOfDetail::kOff;
  if (off != slice) to.add("--lod", off ? "off" : "auto");
  if (o.between == Between::kSum) to.add("--between", "sum");
  if (o.shading) to.add("--shade");
  if (const auto& b = o.background) to.add("--background", listText({b->r, b->g, b->b}));
}

/// Adds the reference if the command can draw it: its grid must have the same name, and the files
/// no frames.
void addReference(const Collection& collection, const SceneWish& scene, Words& to) {
  if (!scene.compare) return;
  const GridPlace& other = scene.compare->with;
  const ShownFile& file = collection.fileAt(other);
  const bool frames = collection.frameAt(scene.place) || collection.frameAt(other);
  if (!frames && collection.gridAt(other).name == collection.gridAt(scene.place).name)
    to.add("--ref", file.path.string());
}

}  // namespace

RenderCommand commandOf(const Collection& collection, const SceneWish& scene, Resolution size) {
  const RenderOptions drawn = renderOptionsOf(collection, scene, size);
  Words words("esvr-render");
  addInput(collection, scene.place, words);
  words.add("--resolution", std::to_string(size.width) + "x" + std::to_string(size.height));
  addCamera(drawn.camera, words);
  RenderCommand command;
  command.transfer = addTransfer(drawn.transfer, words);
  addRays(scene, words);
  addClip(scene, words);
  addReference(collection, scene, words);
  command.text = words.text();
  return command;
}

}  // namespace esvr::view
