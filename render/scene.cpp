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

/// Whether a grid of ellipsoids has so much empty space between its voxels that the table of its blocks
/// of 64^3 voxels, by which rays find bricks (render/brick_table.h), would be too large. Such a grid is
/// decoded at once, and its bricks are found by a search.
bool liesFarApart(const Scene& scene) {
  constexpr double kMostBlocks = double(1 << 26);  // 256 MB
  constexpr double kBlockSide = 64.0;
  const auto* const field = std::get_if<Field>(&scene.content);
  if (field == nullptr || !scene.encoded || fittedBetween(*field) == Between::kSum) return false;
  const auto blocks = [](std::int32_t low, std::int32_t high) {
    return (double(high) - double(low)) / kBlockSide + 2.0;
  };
  const Box& box = scene.box;
  return blocks(box.min.x, box.max.x) * blocks(box.min.y, box.max.y) *
             blocks(box.min.z, box.max.z) >
         kMostBlocks;
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
  scene.transform = grid.descriptor.transform;
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
  const auto* voxels = std::get_if<VolumeGrid>(&scene.content);
  if (!voxels && liesFarApart(scene)) {
    const StoredGrid& stored = *scene.encoded;
    farApart_ = VolumeGrid{
        stored.descriptor,
        decodeGrid(stored, {.maxBytes = s.memory.maxBytes, .memory = s.memory.voxels}), 0};
    voxels = &*farApart_;
  }
  if (voxels && isNano) return sampleNano(*voxels, s);
  if (farApart_) {
    renderer_ = makeVolumeRenderer(farApart_->volume, s.device, s.limits);
    return;
  }
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
