#include "render/view/collection.h"

#include <algorithm>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/vdb_io.h"
#include "programs/option_values.h"

namespace esvr::view {

namespace fs = std::filesystem;

// What files hold.

namespace {

ReadLimits limitsOf(const cli::HostMemory& memory) {
  ReadLimits limits{memory.maxBytes, memory.voxels};
  limits.carriedBytes = false;
  return limits;
}

/// The grids of a file or of a frame that have something active.
/// \param measures  as for render::outlinesOf
std::vector<ShownGrid> gridsOf(const EsvrFile& file, const EsvrSummary& summary,
                               const render::SceneFile& from, bool measures) {
  std::vector<ShownGrid> grids;
  const auto names = namesOfStored(file);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const StoredGrid& stored = file.grids[i];
    if (stored.activeBox.empty()) continue;
    std::vector<render::Scene> outline{render::outlineOf(stored, names[i], from, measures)};
    grids.push_back({names[i], stored.voxels ? "voxels" : "ellipsoids",
                     className(stored.descriptor.gridClass), std::move(outline),
                     stored.field.ellipsoidCount(), cli::storedBytes(summary, i),
                     stored.activeVoxels});
  }
  return grids;
}

/// Widens the outlines of grids to those of another frame, which may have further grids.
void enclose(std::vector<ShownGrid> frame, std::vector<ShownGrid>& all) {
  for (ShownGrid& grid : frame) {
    const auto same = std::find_if(all.begin(), all.end(),
                                   [&](const ShownGrid& g) { return g.name == grid.name; });
    if (same == all.end())
      all.push_back(std::move(grid));
    else
      render::enclose(grid.outline, same->outline);
  }
}

void showSequence(const render::SceneFile& from, ShownFile& file) {
  SequenceReader reader(from.path, limitsOf(from.memory));
  for (const SequenceFrame& frame : reader.frames()) {
    file.frames.push_back(frame.number);
    const EsvrSummary summary = reader.inspect(frame.number);
    enclose(gridsOf(reader.read(frame.number), summary, from, file.grids.empty()), file.grids);
  }
}

/// Removes the voxels of a scene.
std::vector<render::Scene> withoutVoxels(std::vector<render::Scene> scenes) {
  for (render::Scene& scene : scenes) scene.content = VolumeGrid{}, scene.encoded.reset();
  return scenes;
}

void showVdb(const render::SceneFile& from, ShownFile& file) {
  for (const GridSummary& grid : inspectVdb(from.path).grids) {
    if (!grid.skipReason.empty() || grid.activeVoxels == 0) continue;
    render::SceneFile of = from;
    of.grid = grid.uniqueName;
    file.grids.push_back({grid.uniqueName, "vdb", className(grid.gridClass),
                          withoutVoxels(readScenes(of)), 0, grid.storedBytes, grid.activeVoxels});
  }
}

template <class List>
const auto& at(const List& list, std::size_t index, const std::string& what) {
  if (index < list.size()) return list[index];
  throw BadInput("there is no " + what + " " + std::to_string(index));
}

}  // namespace

ShownFile showFile(const fs::path& path, const cli::HostMemory& memory) {
  if (cli::FramePattern::ofInput(path.string()))
    throw BadInput(path.string() +
                   " is a pattern for files of one frame each; esvr-view shows sequences that are "
                   "in one file, which vdb2esvr writes if its output has no pattern");
  ShownFile file{path, 0, {}, {}};
  const render::SceneFile from{path, {}, {}, memory};
  if (cli::framesInFile(path))
    showSequence(from, file);
  else if (path.extension() == ".esvr")
    file.grids = gridsOf(readEsvr(path, limitsOf(memory)), inspectEsvr(path), from, true);
  else
    showVdb(from, file);
  if (file.grids.empty()) throw BadInput(path.string() + ": no grid that can be drawn");
  file.bytes = fs::file_size(path);
  return file;
}

Collection::Collection(const std::vector<fs::path>& paths, const cli::HostMemory& memory) {
  for (const fs::path& path : paths) files_.push_back(showFile(path, memory));
}

const ShownFile& Collection::fileAt(const GridPlace& place) const {
  return at(files_, place.file, "file");
}

const ShownGrid& Collection::gridAt(const GridPlace& place) const {
  const ShownFile& file = fileAt(place);
  return at(file.grids, place.grid, "grid in " + file.path.filename().string() + " of number");
}

std::optional<cli::FrameNumber> Collection::frameAt(const GridPlace& place) const {
  const ShownFile& file = fileAt(place);
  if (file.frames.empty()) return std::nullopt;
  if (!place.frame) return file.frames.front();
  if (std::find(file.frames.begin(), file.frames.end(), *place.frame) == file.frames.end())
    throw BadInput(file.path.filename().string() + " has no frame " + std::to_string(*place.frame));
  return place.frame;
}

// Grids that are ready to be drawn.

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
  return readers_.try_emplace(file, collection_.files()[file].path, limitsOf(settings_.memory))
      .first->second;
}

}  // namespace esvr::view
