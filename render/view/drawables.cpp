#include "render/view/drawables.h"

#include <algorithm>

namespace esvr::view {
namespace {

/// Enough for several clients with a reference each. A sequence that plays fills all places.
constexpr std::size_t kMostKept = 8;

}  // namespace

Renderer& Drawable::renderer(bool shaded) {
  auto& renderer = shaded ? shaded_ : plain_;
  if (!renderer) {
    render::DrawSettings settings = settings_;
    settings.shaded = shaded;
    renderer.emplace(scenes_, settings);
  }
  return **renderer;
}

std::shared_ptr<Drawable> Drawables::get(GridPlace place) {
  place.frame = collection_.frameAt(place);
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [&](const Kept& kept) { return kept.place == place; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return found->drawable;
  }
  if (kept_.size() == kMostKept) kept_.pop_back();
  auto scenes = scenesAt(place);
  auto drawable = scenes ? std::make_shared<Drawable>(std::move(*scenes), settings_) : nullptr;
  kept_.push_front({place, drawable});
  return drawable;
}

std::optional<std::vector<render::Scene>> Drawables::scenesAt(const GridPlace& place) {
  const render::SceneFile file{
      collection_.fileAt(place).path, collection_.gridAt(place).name, {}, settings_.memory};
  if (!place.frame) return readScenes(file);
  return scenesOf(readerOf(place.file).read(*place.frame), file);
}

SequenceReader& Drawables::readerOf(std::size_t file) {
  ReadLimits limits{settings_.memory.maxBytes, settings_.memory.voxels};
  limits.carriedBytes = false;
  return readers_.try_emplace(file, collection_.files()[file].path, limits).first->second;
}

}  // namespace esvr::view
