#include "render/view/scene_json.h"

#include "render/camera_file.h"
#include "render/slice.h"
#include "render/view/json_members.h"
#include "render/view/transfer_json.h"

namespace esvr::view {
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

}  // namespace esvr::view
