#include "render/scene.h"

#include <algorithm>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"
#include "esvr/vdb_io.h"

namespace esvr::render {
namespace {

/// The first grid that is no component of vectors, or else the first one.
std::size_t firstOf(const EsvrFile& file) {
  std::size_t place = 0;
  for (const StoredVector& vector : file.vectors)
    if (vector.first == place) place += kComponents;
  return place < file.grids.size() ? place : 0;
}

std::size_t placeOf(const EsvrFile& file, const std::filesystem::path& path,
                    const std::optional<std::string>& grid) {
  if (file.grids.empty())
    throw BadInput(path.string() + ": no grid that can be drawn; carried grids have no voxels");
  if (!grid) return firstOf(file);
  std::vector<std::string> names;
  for (const auto& g : file.grids) names.push_back(g.descriptor.name);
  return findGrid(names, *grid, path);
}

/// The text of the grid's metadata "unit" or "units"; empty if it has neither.
std::string unitOf(const GridDescriptor& grid) {
  const std::string unit = stringValue(grid.metadata, "unit");
  return unit.empty() ? stringValue(grid.metadata, "units") : unit;
}

/// \throws BadInput  grids that are drawn together differ in their transforms
void requireOneTransform(const std::vector<Scene>& scenes, const std::filesystem::path& path) {
  for (const Scene& scene : scenes)
    if (scene.transform != scenes.front().transform)
      throw BadInput(path.string() + ": " + scenes.front().grid + " and " + scene.grid +
                     " have different transforms and cannot be drawn in one picture");
}

/// A grid without its content.
Scene outlineOf(const StoredGrid& grid) {
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.unit = unitOf(grid.descriptor);
  scene.transform = grid.descriptor.transform;
  scene.box = grid.activeBox;
  scene.data = {grid.valueMin, grid.valueMax};
  scene.background = float(grid.descriptor.background);
  scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  return scene;
}

/// A grid with its content. If it stores its voxels, they are drawn instead of the ellipsoids,
/// because they are exact.
Scene complete(StoredGrid grid, const cli::HostMemory& memory) {
  Scene scene = outlineOf(grid);
  if (grid.voxels)
    scene.content =
        VolumeGrid{grid.descriptor,
                   decodeGrid(grid, {.maxBytes = memory.maxBytes, .memory = memory.voxels}), 0};
  else
    scene.content = grid.field, scene.encoded = std::move(grid);
  return scene;
}

/// The places of the grid and of the further grids of a file.
std::vector<std::size_t> placesOf(const EsvrFile& file, const SceneFile& from) {
  std::vector<std::size_t> places{placeOf(file, from.path, from.grid)};
  for (const std::string& name : from.with) places.push_back(placeOf(file, from.path, name));
  return places;
}

/// Reads grids of an .esvr file.
std::vector<Scene> encoded(const SceneFile& from) {
  ReadLimits limits{from.memory.maxBytes, from.memory.voxels};
  limits.carriedBytes = false;
  EsvrFile file = readEsvr(from.path, limits);
  const auto places = placesOf(file, from);
  std::vector<Scene> scenes;
  for (auto place = places.begin(); place != places.end(); ++place) {
    StoredGrid& grid = file.grids[*place];
    const bool isLast = std::find(place + 1, places.end(), *place) == places.end();
    scenes.push_back(complete(isLast ? std::move(grid) : grid, from.memory));
  }
  return scenes;
}

/// Makes a scene of each grid of a frame.
/// \return nothing if the first grid has nothing active to draw, so that it may be carried
template <class Make>
std::optional<std::vector<Scene>> scenesBy(const EsvrFile& frame, const SceneFile& file,
                                           Make&& make) {
  if (frame.grids.empty()) return std::nullopt;
  std::vector<Scene> scenes;
  for (const std::size_t place : placesOf(frame, file)) scenes.push_back(make(frame.grids[place]));
  requireOneTransform(scenes, file.path);
  return scenes.front().box.empty() ? std::nullopt : std::optional(std::move(scenes));
}

/// \throws BadInput  no grid can be drawn
std::string requiredDrawable(const std::filesystem::path& path) {
  if (auto name = firstDrawable(path)) return std::move(*name);
  throw BadInput(path.string() + ": no grid that can be drawn");
}

/// A grid of a .vdb or .nvdb file, which may have no active voxel.
Scene voxelsOrNone(const SceneFile& from, const std::string& name, bool allowEmpty) {
  ReadOptions options{.maxBytes = from.memory.maxBytes, .memory = from.memory.voxels};
  options.allowEmpty = allowEmpty;
  VolumeGrid grid = readGrid(from.path, name, options);
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.unit = unitOf(grid.descriptor);
  scene.transform = grid.descriptor.transform;
  scene.box = activeBox(grid.volume);
  if (!scene.box.empty()) scene.data = activeRange(grid.volume);
  scene.background = grid.volume.background;
  scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  scene.content = std::move(grid);
  return scene;
}

Scene voxels(const SceneFile& from, const std::string& name) {
  return voxelsOrNone(from, name, false);
}

std::vector<Scene> voxels(const SceneFile& from) {
  std::vector<Scene> scenes{voxels(from, from.grid ? *from.grid : requiredDrawable(from.path))};
  for (const std::string& name : from.with) scenes.push_back(voxels(from, name));
  return scenes;
}

}  // namespace

std::vector<Scene> readScenes(const SceneFile& file) {
  auto scenes = file.path.extension() == ".esvr" ? encoded(file) : voxels(file);
  for (const Scene& scene : scenes)
    if (scene.box.empty())
      throw BadInput(file.path.string() + ", " + scene.grid + ": nothing active to draw");
  requireOneTransform(scenes, file.path);
  return scenes;
}

std::optional<std::vector<Scene>> scenesOf(const EsvrFile& frame, const SceneFile& file) {
  return scenesBy(frame, file, [&](const StoredGrid& grid) { return complete(grid, file.memory); });
}

std::optional<std::vector<Scene>> outlinesOf(const EsvrFile& frame, const SceneFile& file) {
  return scenesBy(frame, file, [](const StoredGrid& grid) {
    Scene scene = outlineOf(grid);
    Field field;  // its ellipsoids are not drawn
    field.fitFor = grid.field.fitFor;
    scene.content = std::move(field);
    return scene;
  });
}

std::optional<std::string> firstDrawable(const std::filesystem::path& path) {
  for (const auto& grid : inspectVdb(path).grids)
    if (grid.skipReason.empty() && grid.activeVoxels > 0) return grid.uniqueName;
  return std::nullopt;
}

namespace {

EsvrFile readFrameFile(const SceneFile& file) {
  ReadLimits limits{file.memory.maxBytes, file.memory.voxels};
  limits.carriedBytes = false;
  return readEsvr(file.path, limits);
}

std::optional<std::vector<Scene>> voxelsOfFrame(const SceneFile& file) {
  const auto first = file.grid ? file.grid : firstDrawable(file.path);
  if (!first || inspectVdb(file.path).grids.empty()) return std::nullopt;
  std::vector<Scene> scenes{voxelsOrNone(file, *first, true)};
  for (const std::string& name : file.with) scenes.push_back(voxelsOrNone(file, name, true));
  requireOneTransform(scenes, file.path);
  return scenes.front().box.empty() ? std::nullopt : std::optional(std::move(scenes));
}

}  // namespace

std::optional<std::vector<Scene>> readFrame(const SceneFile& file) {
  return file.path.extension() == ".esvr" ? scenesOf(readFrameFile(file), file)
                                          : voxelsOfFrame(file);
}

std::optional<std::vector<Scene>> readFrameOutlines(const SceneFile& file) {
  if (file.path.extension() == ".esvr") return outlinesOf(readFrameFile(file), file);
  auto scenes = voxelsOfFrame(file);
  if (scenes)
    for (Scene& scene : *scenes) scene.content = VolumeGrid{};
  return scenes;
}

void enclose(const std::vector<Scene>& others, std::vector<Scene>& scenes) {
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const Scene& other = others[i];
    if (other.box.empty()) continue;
    scenes[i].box.expand(other.box.min), scenes[i].box.expand(other.box.max);
    scenes[i].data.expand(other.data);
  }
}

SceneRenderer::SceneRenderer(const std::vector<Scene>& scenes, const DrawSettings& s) {
  if (scenes.size() == 1) {
    drawAlone(scenes.front(), s);
    return;
  }
  std::vector<DrawnGrid> grids;
  for (const Scene& scene : scenes) grids.push_back(drawnGrid(scene, s.memory));
  renderer_ = makeGridsRenderer(grids, s.device, s.limits);
}

DrawnGrid SceneRenderer::drawnGrid(const Scene& scene, const cli::HostMemory& memory) {
  if (const auto* const grid = std::get_if<VolumeGrid>(&scene.content)) return &grid->volume;
  const StoredGrid& stored = *scene.encoded;
  if (followsFromEllipsoids(stored))
    return DrawnField{&std::get<Field>(scene.content), voxelRule(stored)};
  decoded_.push_back(decodeGrid(stored, {.maxBytes = memory.maxBytes, .memory = memory.voxels}));
  return &decoded_.back();
}

void SceneRenderer::drawAlone(const Scene& scene, const DrawSettings& s) {
  const bool isNano = !s.shaded && (s.device.kind == DeviceKind::kCuda || s.values);
  const auto* const voxels = std::get_if<VolumeGrid>(&scene.content);
  if (voxels && isNano) return sampleNano(*voxels, s);
  const DrawnGrid grid = drawnGrid(scene, s.memory);
  if (const auto* const drawn = std::get_if<DrawnField>(&grid))
    renderer_ = makeFieldRenderer(*drawn->field, s.device, s.limits, drawn->voxels);
  else
    renderer_ = makeVolumeRenderer(*std::get<const SparseVolume*>(grid), s.device, s.limits);
}

void SceneRenderer::sampleNano(const VolumeGrid& grid, const DrawSettings& s) {
  nano_ = makeNanoVolume(grid, s.values.value_or(NanoValues::kFloat));
  renderer_ = makeNanoRenderer(nano_, s.device, s.limits);
}

}  // namespace esvr::render
