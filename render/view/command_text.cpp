#include "render/view/command_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "programs/messages.h"
#include "render/view/painting.h"

namespace esvr::view {

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

/// The shortest text that gives the number back.
std::string numberText(double v) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), v).ptr;
  return {text.data(), end};
}

std::string listText(std::initializer_list<double> numbers) {
  std::string text;
  for (const double v : numbers) text += (text.empty() ? "" : ",") + numberText(v);
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
  if (camera.projection == Projection::kPerspective) return to.add("--fov", numberText(camera.fov));
  to.add("--orthographic");
  to.add("--height", numberText(camera.height));
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
    return to.add("--slice", kAxes[*scene.sliceAxis] + numberText(*scene.slicePlace));
  if (const auto& clip = scene.options.clip)
    to.add("--clip", listText(clip->low) + "," + listText(clip->high));
}

/// Adds the options of the rays that differ from the defaults of esvr-render.
void addRays(const SceneWish& scene, Words& to) {
  const render::Options& o = scene.options;
  const render::Options usual;
  const bool slice = scene.sliceAxis.has_value();
  if (o.opacityLength != usual.opacityLength)
    to.add("--opacity-length", numberText(o.opacityLength));
  if (o.step != usual.step) to.add("--step", numberText(o.step));
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
