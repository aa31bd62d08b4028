#include "render/scene.h"

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

Scene outlineOf(const StoredGrid& grid) {
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.unit = unitOf(grid.descriptor);
  scene.box = grid.activeBox;
  scene.data = {grid.valueMin, grid.valueMax};
  scene.background = float(grid.descriptor.background);
  scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
  return scene;
}

/// A grid with its content. If it stores its voxels, they are drawn instead of the ellipsoids,
/// because they are exact.
Scene complete(StoredGrid grid, const SceneFile& from) {
  Scene scene = outlineOf(grid);
  if (grid.voxels)
    scene.content = VolumeGrid{
        grid.descriptor,
        decodeGrid(grid, {.maxBytes = from.memory.maxBytes, .memory = from.memory.voxels}), 0};
  else
    scene.content = grid.field, scene.encoded = std::move(grid);
  return scene;
}

/// Reads a grid of an .esvr file.
Scene encoded(const SceneFile& from) {
  ReadLimits limits{from.memory.maxBytes, from.memory.voxels};
  limits.carriedBytes = false;
  EsvrFile file = readEsvr(from.path, limits);
  return complete(std::move(file.grids[placeOf(file, from.path, from.grid)]), from);
}

/// The grid of a frame; null if it has nothing active to draw, so that it may be carried.
const StoredGrid* gridOf(const EsvrFile& frame, const SceneFile& file) {
  if (frame.grids.empty()) return nullptr;
  const StoredGrid& grid = frame.grids[placeOf(frame, file.path, file.grid)];
  return grid.activeBox.empty() ? nullptr : &grid;
}

std::string firstDrawable(const std::filesystem::path& path) {
  for (const auto& grid : inspectVdb(path).grids)
    if (grid.skipReason.empty() && grid.activeVoxels > 0) return grid.uniqueName;
  throw BadInput(path.string() + ": no grid that can be drawn");
}

Scene voxels(const SceneFile& from) {
  VolumeGrid grid = readGrid(from.path, from.grid ? *from.grid : firstDrawable(from.path),
                             {.maxBytes = from.memory.maxBytes, .memory = from.memory.voxels});
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

}  // namespace

Scene readScene(const SceneFile& file) {
  Scene scene = file.path.extension() == ".esvr" ? encoded(file) : voxels(file);
  if (scene.box.empty()) throw BadInput(file.path.string() + ": nothing active to draw");
  return scene;
}

std::optional<Scene> sceneOf(const EsvrFile& frame, const SceneFile& file) {
  const StoredGrid* grid = gridOf(frame, file);
  return grid ? std::optional(complete(*grid, file)) : std::nullopt;
}

std::optional<Scene> outlineOf(const EsvrFile& frame, const SceneFile& file) {
  const StoredGrid* grid = gridOf(frame, file);
  if (!grid) return std::nullopt;
  Scene scene = outlineOf(*grid);
  Field field;  // its ellipsoids are not drawn
  field.fitFor = grid->field.fitFor;
  scene.content = std::move(field);
  return scene;
}

void enclose(const Scene& other, Scene& scene) {
  scene.box = {minCoord(scene.box.min, other.box.min), maxCoord(scene.box.max, other.box.max)};
  scene.data.expand(other.data);
}

SceneRenderer::SceneRenderer(const Scene& scene, const DrawSettings& s) {
  if (const auto* field = std::get_if<Field>(&scene.content))
    drawField(*field, *scene.encoded, s);
  else
    sampleVoxels(std::get<VolumeGrid>(scene.content), s);
}

void SceneRenderer::drawField(const Field& field, const StoredGrid& grid, const DrawSettings& s) {
  if (followsFromEllipsoids(grid)) {
    renderer_ = makeFieldRenderer(field, s.device, s.limits, voxelRule(grid));
    return;
  }
  decoded_ = decodeGrid(grid, {.maxBytes = s.memory.maxBytes, .memory = s.memory.voxels});
  renderer_ = makeVolumeRenderer(decoded_, s.device, s.limits);
}

void SceneRenderer::sampleVoxels(const VolumeGrid& grid, const DrawSettings& s) {
  if (s.shaded || (s.device.kind == DeviceKind::kCpu && !s.values)) {
    renderer_ = makeVolumeRenderer(grid.volume, s.device, s.limits);
    return;
  }
  nano_ = makeNanoVolume(grid, s.values.value_or(NanoValues::kFloat));
  renderer_ = makeNanoRenderer(nano_, s.device, s.limits);
}

}  // namespace esvr::render
