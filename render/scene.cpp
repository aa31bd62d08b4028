#include "render/scene.h"

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"
#include "esvr/grid_names.h"
#include "esvr/vdb_io.h"

namespace esvr::render {
namespace {

std::size_t placeOf(const EsvrFile& file, const std::filesystem::path& path,
                    const std::optional<std::string>& grid) {
  if (file.grids.empty()) throw BadInput(path.string() + ": no grids");
  if (!grid) return 0;
  std::vector<std::string> names;
  for (const auto& g : file.grids) names.push_back(g.descriptor.name);
  return findGrid(names, *grid, path);
}

/// A grid that holds its voxels is drawn from them: they are what it stands for.
Scene encoded(const std::filesystem::path& path, const std::optional<std::string>& wanted) {
  EsvrFile file = readEsvr(path);
  EncodedGrid& grid = file.grids[placeOf(file, path, wanted)];
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.box = grid.activeBox;
  scene.data = {grid.valueMin, grid.valueMax};
  scene.background = float(grid.descriptor.background);
  if (grid.voxels)
    scene.content = VolumeGrid{grid.descriptor, decodeGrid(grid), 0};
  else
    scene.content = std::move(grid.field);
  return scene;
}

std::string firstDrawable(const std::filesystem::path& path) {
  for (const auto& grid : inspectVdb(path).grids)
    if (grid.skipReason.empty() && grid.activeVoxels > 0) return grid.uniqueName;
  throw BadInput(path.string() + ": no grid that can be drawn");
}

Scene voxels(const std::filesystem::path& path, const std::optional<std::string>& wanted) {
  VolumeGrid grid = readGrid(path, wanted ? *wanted : firstDrawable(path));
  Scene scene;
  scene.grid = grid.descriptor.name;
  scene.box = activeBox(grid.volume);
  scene.data = activeRange(grid.volume);
  scene.background = grid.volume.background;
  scene.content = std::move(grid);
  return scene;
}

}  // namespace

Scene readScene(const std::filesystem::path& path, const std::optional<std::string>& grid) {
  Scene scene = path.extension() == ".esvr" ? encoded(path, grid) : voxels(path, grid);
  if (scene.box.empty()) throw BadInput(path.string() + ": nothing active to draw");
  return scene;
}

SceneRenderer::SceneRenderer(const Scene& scene, const DrawSettings& s) {
  if (const auto* field = std::get_if<Field>(&scene.content)) {
    renderer_ = makeFieldRenderer(*field, s.device, s.limits);
    return;
  }
  const auto& grid = std::get<VolumeGrid>(scene.content);
  if (s.device.kind == DeviceKind::kCpu && !s.values) {
    renderer_ = makeVolumeRenderer(grid.volume);
    return;
  }
  nano_ = makeNanoVolume(grid, s.values.value_or(NanoValues::kFloat));
  renderer_ = makeNanoRenderer(nano_, s.device, s.limits);
}

}  // namespace esvr::render
