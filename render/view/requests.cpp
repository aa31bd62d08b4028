#include "render/view/requests.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "render/camera_file.h"

namespace esvr::view {

// Members of objects.

Members::Members(const json& object, std::string name) : object_(object), name_(std::move(name)) {
  if (!object.is_object()) throw BadInput("\"" + name_ + "\" must be an object");
}

void Members::requireKnown(std::initializer_list<std::string_view> names) const {
  for (const auto& [key, value] : object_.items())
    if (std::find(names.begin(), names.end(), key) == names.end()) refuse(key, "is not known");
}

const json* Members::find(const char* name) const {
  const auto found = object_.find(name);
  return found == object_.end() || found->is_null() ? nullptr : &*found;
}

const json& Members::at(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) refuse(name, "is missing");
  return *value;
}

std::optional<double> Members::number(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) refuse(name, "must be a number");
  return value->get<double>();
}

std::optional<double> Members::number(const char* name, double low, double high) const {
  const auto value = number(name);
  if (value && !(*value >= low && *value <= high))
    refuse(name, "must be from " + json(low).dump() + " to " + json(high).dump());
  return value;
}

std::optional<std::int64_t> Members::whole(const char* name, std::int64_t low,
                                           std::int64_t high) const {
  const auto value = number(name, double(low), double(high));
  if (!value) return std::nullopt;
  if (*value != std::floor(*value)) refuse(name, "must be a whole number");
  return std::int64_t(*value);
}

std::optional<bool> Members::flag(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_boolean()) refuse(name, "must be true or false");
  return value->get<bool>();
}

std::optional<std::string> Members::text(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  if (!value->is_string()) refuse(name, "must be a text");
  return value->get<std::string>();
}

std::optional<Vec3> Members::vector(const char* name) const {
  const json* const value = find(name);
  if (value == nullptr) return std::nullopt;
  const auto v = numbersOf(*value, 3, nameOf(name));
  return Vec3{v[0], v[1], v[2]};
}

void Members::refuse(const std::string& name, const std::string& what) const {
  throw BadInput("\"" + nameOf(name) + "\" " + what);
}

std::vector<double> numbersOf(const json& array, std::size_t count, const std::string& name) {
  const bool fits =
      array.is_array() && array.size() == count &&
      std::all_of(array.begin(), array.end(), [](const json& v) { return v.is_number(); });
  if (!fits)
    throw BadInput("\"" + name + "\" must be a list of " + std::to_string(count) + " numbers");
  return array.get<std::vector<double>>();
}

// Transfer functions.

namespace {

constexpr std::size_t kMostPoints = 2048;

struct SpaceName {
  const char* name;
  ColorSpace space;
};
constexpr std::array kSpaces{SpaceName{"RGB", ColorSpace::kRgb},
                             SpaceName{"HSV", ColorSpace::kHsv},
                             SpaceName{"HSVWrap", ColorSpace::kHsvWrap},
                             SpaceName{"Lab", ColorSpace::kLab},
                             SpaceName{"Diverging", ColorSpace::kDiverging},
                             SpaceName{"Step", ColorSpace::kStep}};

ColorSpace spaceOf(const Members& members) {
  const auto name = members.text("space");
  if (!name) return ColorSpace::kRgb;
  for (const SpaceName& known : kSpaces)
    if (*name == known.name) return known.space;
  members.refuse("space", "must be RGB, HSV, HSVWrap, Lab, Diverging or Step");
}

const char* nameOf(ColorSpace space) {
  for (const SpaceName& known : kSpaces)
    if (space == known.space) return known.name;
  throw std::logic_error("jsonOf: no such color space");
}

/// The rows of an array of points.
const json& rowsOf(const Members& members, const char* name) {
  const json& rows = members.at(name);
  if (!rows.is_array() || rows.empty() || rows.size() > kMostPoints)
    members.refuse(name, "must be a list of 1 to " + std::to_string(kMostPoints) + " points");
  return rows;
}

}  // namespace

json jsonOf(const ColorMap& map) {
  json points = json::array();
  for (const ColorPoint& p : map.points) points.push_back({p.x, p.color.r, p.color.g, p.color.b});
  return {{"space", nameOf(map.space)}, {"points", points}};
}

json jsonOf(const OpacityCurve& curve) {
  json points = json::array();
  for (const OpacityPoint& p : curve) points.push_back({p.x, p.opacity, p.midpoint, p.sharpness});
  return points;
}

json jsonOf(const TransferFunction& function) {
  const json colors = jsonOf(function.colors);
  return {{"space", colors["space"]},
          {"colors", colors["points"]},
          {"opacity", jsonOf(function.opacity)}};
}

TransferFunction transferOf(const json& content) {
  const Members members(content, "transfer");
  members.requireKnown({"space", "colors", "opacity"});
  TransferFunction f;
  f.colors.space = spaceOf(members);
  for (const json& row : rowsOf(members, "colors")) {
    const auto v = numbersOf(row, 4, members.nameOf("colors"));
    f.colors.points.push_back({v[0], {v[1], v[2], v[3]}});
  }
  for (const json& row : rowsOf(members, "opacity")) {
    const auto v = numbersOf(row, 4, members.nameOf("opacity"));
    f.opacity.push_back({v[0], v[1], v[2], v[3]});
  }
  checkTransferFunction(f);
  return f;
}

// Scenes.

namespace {

constexpr std::int64_t kMostGridsAndFiles = 1'000'000;
constexpr std::int64_t kLargestFrame = 1'000'000'000'000'000;
constexpr double kMinStep = 0.05, kMaxStep = 1e6;                    // voxels
constexpr double kMinOpacityLength = 1e-6, kMaxOpacityLength = 1e6;  // voxels
constexpr double kMaxGain = 1e6;

GridPlace placeIn(const Members& members) {
  GridPlace place;
  place.file = std::size_t(members.whole("file", 0, kMostGridsAndFiles).value_or(0));
  place.grid = std::size_t(members.whole("grid", 0, kMostGridsAndFiles).value_or(0));
  place.frame = members.whole("frame", -kLargestFrame, kLargestFrame);
  return place;
}

CameraWish cameraIn(const Members& members) {
  const json* const camera = members.find("camera");
  if (camera == nullptr) return {};
  try {
    return render::cameraWish(*camera);
  } catch (const BadInput& error) {
    members.refuse("camera", error.what());
  }
}

/// The transfer function over its own range of values; nothing gives the grid's usual look.
render::Look lookIn(const Members& members) {
  render::Look look;
  const json* const transfer = members.find("transfer");
  if (transfer == nullptr) return look;
  look.transfer = transferOf(*transfer);
  look.rangeKind = render::RangeKind::kOwn;
  return look;
}

std::optional<Rgb> backgroundIn(const Members& members) {
  const auto color = members.vector("background");
  if (!color) return std::nullopt;
  for (const double channel : *color)
    if (!(channel >= 0.0 && channel <= 1.0))
      members.refuse("background", "must have channels from 0 to 1");
  return Rgb{(*color)[0], (*color)[1], (*color)[2]};
}

std::optional<PlaceBox> clipIn(const Members& members) {
  const json* const clip = members.find("clip");
  if (clip == nullptr) return std::nullopt;
  if (!clip->is_array() || clip->size() != 2)
    members.refuse("clip", "must be a list of two corners");
  const auto low = numbersOf((*clip)[0], 3, members.nameOf("clip"));
  const auto high = numbersOf((*clip)[1], 3, members.nameOf("clip"));
  return PlaceBox{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

void readSlice(const Members& members, SceneWish& wish) {
  const json* const content = members.find("slice");
  if (content == nullptr) return;
  if (wish.options.clip) throw UsageError("a scene has a clip box or a slice, not both");
  const Members slice(*content, members.nameOf("slice"));
  slice.requireKnown({"axis", "place"});
  wish.sliceAxis = slice.choice<std::size_t>("axis", {{"x", 0}, {"y", 1}, {"z", 2}});
  wish.slicePlace = slice.number("place");
  if (!wish.sliceAxis) slice.refuse("axis", "is missing");
  if (!wish.slicePlace) slice.refuse("place", "is missing");
  wish.options.clip = render::sliceBox(*wish.sliceAxis, *wish.slicePlace);
}

/// The rays. The defaults for a slice are those of esvr-render.
void readRays(const Members& members, SceneWish& wish) {
  render::Options& o = wish.options;
  const bool slice = wish.sliceAxis.has_value();
  o.step = members.number("step", kMinStep, kMaxStep).value_or(o.step);
  o.opacityLength = members.number("opacityLength", kMinOpacityLength, kMaxOpacityLength)
                        .value_or(o.opacityLength);
  o.mode = members
               .choice<RenderMode>("mode", {{"composite", RenderMode::kComposite},
                                            {"maximum", RenderMode::kMaximum},
                                            {"average", RenderMode::kAverage}})
               .value_or(o.mode);
  o.classification =
      members
          .choice<Classification>("classification", {{"pre", Classification::kPreIntegrated},
                                                     {"post", Classification::kPost}})
          .value_or(slice ? Classification::kPost : o.classification);
  o.lod = members
              .choice<LevelOfDetail>("lod",
                                     {{"auto", LevelOfDetail::kAuto}, {"off", LevelOfDetail::kOff}})
              .value_or(slice ? LevelOfDetail::kOff : o.lod);
  o.between =
      members.choice<Between>("between", {{"voxels", Between::kVoxels}, {"sum", Between::kSum}})
          .value_or(o.between);
  if (members.flag("shade").value_or(false)) o.shading = Shading{};
}

std::optional<Comparison> comparisonIn(const Members& members) {
  const json* const content = members.find("compare");
  if (content == nullptr) return std::nullopt;
  const Members compare(*content, members.nameOf("compare"));
  compare.requireKnown({"file", "grid", "frame", "show", "split", "gain"});
  Comparison c;
  c.with = placeIn(compare);
  c.show = compare
               .choice<CompareShow>("show", {{"split", CompareShow::kSplit},
                                             {"reference", CompareShow::kReference},
                                             {"difference", CompareShow::kDifference}})
               .value_or(c.show);
  c.split = compare.number("split", 0.0, 1.0).value_or(c.split);
  c.gain = compare.number("gain", 0.0, kMaxGain).value_or(c.gain);
  return c;
}

}  // namespace

GridPlace placeOf(const json& content, const std::string& name) {
  return placeIn(Members(content, name));
}

SceneWish sceneOf(const json& content) {
  const Members members(content, "scene");
  members.requireKnown({"file", "grid", "frame", "camera", "transfer", "opacityLength", "step",
                        "mode", "classification", "shade", "lod", "between", "background", "clip",
                        "slice", "compare"});
  SceneWish wish;
  wish.place = placeIn(members);
  wish.options.camera = cameraIn(members);
  wish.options.look = lookIn(members);
  wish.options.background = backgroundIn(members);
  wish.options.clip = clipIn(members);
  readSlice(members, wish);
  readRays(members, wish);
  wish.compare = comparisonIn(members);
  return wish;
}

json jsonOf(const Camera& camera) {
  json content{{"eye", camera.eye}, {"center", camera.center}, {"up", camera.up}};
  if (camera.projection == Projection::kPerspective)
    content["fov"] = camera.fov;
  else
    content["height"] = camera.height;
  return content;
}

// Requests.

namespace {

constexpr std::int64_t kLargestId = std::int64_t{1} << 53;  // JavaScript's whole numbers

int sideOf(const Members& members, const char* name) {
  const auto side = members.whole(name, 1, kMaxPictureSide);
  if (!side) members.refuse(name, "is missing");
  return int(*side);
}

PictureRequest pictureOf(const Members& members) {
  const auto id = members.whole("id", 0, kLargestId);
  if (!id) members.refuse("id", "is missing");
  return {*id, {sideOf(members, "width"), sideOf(members, "height")}, sceneOf(members.at("scene"))};
}

}  // namespace

Resolution sizeOf(const json& content, const std::string& name) {
  const Members members(content, name);
  return {sideOf(members, "width"), sideOf(members, "height")};
}

DrawRequest drawRequestOf(const json& content) {
  const Members members(content, "draw");
  members.requireKnown({"type", "id", "width", "height", "quality", "moving", "scene"});
  DrawRequest request;
  request.quality = members.number("quality", 0.0, 1.0).value_or(request.quality);
  request.moving = members.flag("moving").value_or(request.moving);
  request.picture = pictureOf(members);
  return request;
}

PictureRequest pngRequestOf(const json& content) {
  const Members members(content, "png");
  members.requireKnown({"type", "id", "width", "height", "scene"});
  return pictureOf(members);
}

}  // namespace esvr::view
