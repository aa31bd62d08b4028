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

/// The scene of a stored grid. If the grid stores its voxels, they are drawn instead of the
/// ellipsoids, because they are exact.
Scene sceneOf(StoredGrid grid, const cli::HostMemory& memory) {
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.unit = unitOf(grid.descriptor);
  scene.box = grid.activeBox;
  scene.data = {grid.valueMin, grid.valueMax};
  scene.background = float(grid.descriptor.background);
  scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  if (grid.voxels)
    scene.content =
        VolumeGrid{grid.descriptor,
                   decodeGrid(grid, {.maxBytes = memory.maxBytes, .memory = memory.voxels}), 0};
  else
    scene.content = grid.field, scene.encoded = std::move(grid);
  return scene;
}

/// Reads grids of an .esvr file.
std::vector<Scene> encoded(const SceneFile& from) {
  ReadLimits limits{from.memory.maxBytes, from.memory.voxels};
  limits.carriedBytes = false;
  EsvrFile file = readEsvr(from.path, limits);
  std::vector<std::size_t> places{placeOf(file, from.path, from.grid)};
  for (const std::string& name : from.with) places.push_back(placeOf(file, from.path, name));
  std::vector<Scene> scenes;
  for (auto place = places.begin(); place != places.end(); ++place) {
    StoredGrid& grid = file.grids[*place];
    const bool isLast = std::find(place + 1, places.end(), *place) == places.end();
    scenes.push_back(sceneOf(isLast ? std::move(grid) : grid, from.memory));
  }
  return scenes;
}

std::string firstDrawable(const std::filesystem::path& path) {
  for (const auto& grid : inspectVdb(path).grids)
    if (grid.skipReason.empty() && grid.activeVoxels > 0) return grid.uniqueName;
  throw BadInput(path.string() + ": no grid that can be drawn");
}

Scene voxels(const SceneFile& from, const std::string& name) {
  VolumeGrid grid =
      readGrid(from.path, name, {.maxBytes = from.memory.maxBytes, .memory = from.memory.voxels});
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.unit = unitOf(grid.descriptor);
  scene.box = activeBox(grid.volume);
  scene.data = activeRange(grid.volume);
  scene.background = grid.volume.background;
  scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  scene.content = std::move(grid);
  return scene;
}

std::vector<Scene> voxels(const SceneFile& from) {
  std::vector<Scene> scenes{voxels(from, from.grid ? *from.grid : firstDrawable(from.path))};
  for (const std::string& name : from.with) scenes.push_back(voxels(from, name));
  return scenes;
}

const Transform& transformOf(const Scene& scene) {
  const auto* const grid = std::get_if<VolumeGrid>(&scene.content);
  return grid ? grid->descriptor.transform : scene.encoded->descriptor.transform;
}

}  // namespace

std::vector<Scene> readScenes(const SceneFile& file) {
  auto scenes = file.path.extension() == ".esvr" ? encoded(file) : voxels(file);
  for (const Scene& scene : scenes) {
    if (scene.box.empty())
      throw BadInput(file.path.string() + ", " + scene.grid + ": nothing active to draw");
    if (transformOf(scene) != transformOf(scenes.front()))
      throw BadInput(file.path.string() + ": " + scenes.front().grid + " and " + scene.grid +
                     " have different transforms and cannot be drawn in one picture");
  }
  return scenes;
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
