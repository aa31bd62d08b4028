#include "render/scene.h"

#include <algorithm>

#include "esvr/container.h"
#include "esvr/error.h"
#include "esvr/grid.h"
#include "esvr/transfer_function.h"
#include "esvr/vdb_io.h"

namespace esvr::render {

// Reading.

namespace {

/// The first grid that is no component of vectors, or else the first one.
std::size_t firstOf(const EsvrFile& file) {
  std::size_t place = 0;
  for (const StoredVector& vector : file.vectors)
    if (vector.first == place) place += kComponents;
  return place < file.grids.size() ? place : 0;
}

/// Whether the preferred grid of a file is to be drawn. \throws BadInput  its name is ambiguous
bool takesPreferred(const SceneFile& from, const GridNames& names) {
  if (!from.preferred || from.grid) return false;
  if (names.isAmbiguous(*from.preferred)) (void)names.find(*from.preferred, from.path);
  return names.lookUp(*from.preferred).has_value();
}

/// The index of the grid in EsvrFile::grids that is drawn.
std::size_t placeOf(const EsvrFile& file, const SceneFile& from) {
  if (file.grids.empty())
    throw BadInput(from.path.string() +
                   (file.carried.empty()
                        ? ": the file has no grid, so there is nothing to draw"
                        : ": no grid that can be drawn; carried grids have no voxels"));
  if (from.grid) return findStored(file, *from.grid, from.path);
  const GridNames names(namesInOrder(file));
  if (!takesPreferred(from, names)) return firstOf(file);
  const NamedGrid preferred = names.find(*from.preferred);
  const GridOfFile grid = gridsInOrder(file)[preferred.place];
  const bool isDrawable = !grid.isCarried && grid.isVector == preferred.component.has_value();
  return isDrawable ? findStored(file, *from.preferred, from.path) : firstOf(file);
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

/// A grid without its content. \param name  by which users find it
Scene propertiesOf(const StoredGrid& grid, const std::string& name) {
  Scene scene;
  scene.grid = name;
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
Scene complete(StoredGrid grid, const std::string& name, const cli::HostMemory& memory) {
  Scene scene = propertiesOf(grid, name);
  if (grid.voxels) {
    VolumeGrid decoded{
        grid.descriptor,
        decodeGrid(grid,
                   {.maxBytes = memory.maxBytes, .memory = memory.voxels, .keepsNonFinite = false}),
        0};
    scene.medianDepth = lookBasis(decoded.descriptor, decoded.volume).medianDepth;
    scene.content = std::move(decoded);
  } else {
    scene.medianDepth = lookBasis(grid, memory.maxBytes).medianDepth;
    scene.content = grid.field, scene.encoded = std::move(grid);
  }
  return scene;
}

/// The places of the grid and of the further grids of a file.
std::vector<std::size_t> placesOf(const EsvrFile& file, const SceneFile& from) {
  std::vector<std::size_t> places{placeOf(file, from)};
  for (const std::string& name : from.with) places.push_back(findStored(file, name, from.path));
  return places;
}

/// The content of an .esvr file without the bytes of carried grids.
EsvrFile contentOf(const SceneFile& file) {
  ReadLimits limits{file.memory.maxBytes, file.memory.voxels};
  limits.carriedBytes = false;
  return readEsvr(file.path, limits);
}

/// Reads grids of an .esvr file.
std::vector<Scene> encoded(const SceneFile& from) {
  EsvrFile file = contentOf(from);
  const auto places = placesOf(file, from);
  const auto names = namesOfStored(file);
  std::vector<Scene> scenes;
  for (auto place = places.begin(); place != places.end(); ++place) {
    StoredGrid& grid = file.grids[*place];
    const bool isLast = std::find(place + 1, places.end(), *place) == places.end();
    scenes.push_back(complete(isLast ? std::move(grid) : grid, names[*place], from.memory));
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
  const auto names = namesOfStored(frame);
  for (const std::size_t place : placesOf(frame, file))
    scenes.push_back(make(frame.grids[place], names[place]));
  requireOneTransform(scenes, file.path);
  return scenes.front().box.empty() ? std::nullopt : std::optional(std::move(scenes));
}

/// The grids of a .vdb or .nvdb file.
class GridsOfVdb {
 public:
  explicit GridsOfVdb(const SceneFile& from)
      : from_(from), grids_(inspectVdb(from.path).grids), names_(namesOf(grids_)) {}

  [[nodiscard]] std::vector<Scene> scenes() const {
    std::vector<Scene> scenes{scene(from_.grid ? named(*from_.grid) : requiredDrawable())};
    for (const std::string& name : from_.with) scenes.push_back(scene(named(name)));
    return scenes;
  }

  /// The scenes of a frame of a sequence, whose grids may be empty.
  /// \return nothing if there is nothing active to draw
  [[nodiscard]] std::optional<std::vector<Scene>> frame() const {
    if (grids_.empty()) return std::nullopt;
    const auto first = from_.grid ? std::optional(named(*from_.grid)) : firstDrawable();
    if (!first) return std::nullopt;
    std::vector<Scene> scenes{scene(*first, true)};
    for (const std::string& name : from_.with) scenes.push_back(scene(named(name), true));
    requireOneTransform(scenes, from_.path);
    return scenes.front().box.empty() ? std::nullopt : std::optional(std::move(scenes));
  }

  /// The name of the grid that is drawn where none is named.
  [[nodiscard]] std::optional<std::string> firstDrawableName() const {
    const auto first = firstDrawable();
    return first ? std::optional(nameOf(*first)) : std::nullopt;
  }

 private:
  static GridNames namesOf(const std::vector<GridSummary>& grids) {
    std::vector<std::string> names;
    for (const GridSummary& grid : grids) names.push_back(grid.name);
    return GridNames(std::move(names));
  }

  /// The grid or the component that a user names.
  [[nodiscard]] NamedGrid named(const std::string& name) const {
    const NamedGrid grid = names_.find(name, from_.path);
    if (!grid.component && grids_[grid.place].isVector)
      throw BadInput(from_.path.string() + ": grid \"" + names_.unique(grid.place) +
                     "\" has vectors; name a component, such as \"" +
                     names_.ofComponent(grid.place, 0) + '"');
    return grid;
  }

  [[nodiscard]] bool isDrawable(const NamedGrid& grid) const {
    const GridSummary& summary = grids_[grid.place];
    if (grid.component) return summary.isVector;
    return summary.skipReason.empty() && summary.activeVoxels > 0;
  }

  /// The preferred grid, or the first one of numbers, or else the first component of vectors.
  [[nodiscard]] std::optional<NamedGrid> firstDrawable() const {
    if (takesPreferred(from_, names_))
      if (const NamedGrid preferred = names_.find(*from_.preferred); isDrawable(preferred))
        return preferred;
    for (std::size_t g = 0; g < grids_.size(); ++g)
      if (isDrawable({g})) return NamedGrid{g};
    for (std::size_t g = 0; g < grids_.size(); ++g)
      if (grids_[g].isVector) return NamedGrid{g, 0};
    return std::nullopt;
  }

  [[nodiscard]] NamedGrid requiredDrawable() const {
    if (const auto first = firstDrawable()) return *first;
    throw BadInput(from_.path.string() +
                   (grids_.empty() ? ": the file has no grid, so there is nothing to draw"
                                   : ": no grid that can be drawn"));
  }

  [[nodiscard]] std::string nameOf(const NamedGrid& grid) const {
    return grid.component ? names_.ofComponent(grid.place, *grid.component)
                          : names_.unique(grid.place);
  }

  [[nodiscard]] Scene scene(const NamedGrid& named, bool allowEmpty = false) const {
    const ReadOptions options{.nonFinite = NonFinite::kBackground,
                              .allowEmpty = allowEmpty,
                              .maxBytes = from_.memory.maxBytes,
                              .memory = from_.memory.voxels};
    VolumeGrid grid = named.component
                          ? readComponent(from_.path, named.place, *named.component, options)
                          : readGrid(from_.path, named.place, options);
    Scene scene;
    scene.grid = nameOf(named);
    scene.unit = unitOf(grid.descriptor);
    scene.transform = grid.descriptor.transform;
    scene.box = activeBox(grid.volume);
    if (!scene.box.empty()) scene.data = activeRange(grid.volume);
    scene.background = grid.volume.background;
    scene.isLevelSet = grid.descriptor.gridClass == GridClass::kLevelSet;
    scene.medianDepth = lookBasis(grid.descriptor, grid.volume).medianDepth;
    scene.content = std::move(grid);
    return scene;
  }

  const SceneFile& from_;
  std::vector<GridSummary> grids_;
  GridNames names_;
};

}  // namespace

std::vector<Scene> readScenes(const SceneFile& file) {
  const cli::WatchedInputs watched({file.path});  // grid after grid is read from it
  auto scenes = file.path.extension() == ".esvr" ? encoded(file) : GridsOfVdb(file).scenes();
  watched.requireUnchanged();
  for (const Scene& scene : scenes)
    if (scene.box.empty())
      throw BadInput(file.path.string() + ", " + scene.grid + ": nothing active to draw");
  requireOneTransform(scenes, file.path);
  return scenes;
}

std::optional<std::vector<Scene>> scenesOf(const EsvrFile& frame, const SceneFile& file) {
  return scenesBy(frame, file, [&](const StoredGrid& grid, const std::string& name) {
    return complete(grid, name, file.memory);
  });
}

Scene outlineOf(const StoredGrid& grid, const std::string& name, const SceneFile& file,
                bool measures) {
  Scene scene = propertiesOf(grid, name);
  if (measures) scene.medianDepth = lookBasis(grid, file.memory.maxBytes).medianDepth;
  scene.content = Field{};  // its ellipsoids are not drawn
  return scene;
}

std::optional<std::vector<Scene>> outlinesOf(const EsvrFile& frame, const SceneFile& file,
                                             bool measures) {
  return scenesBy(frame, file, [&](const StoredGrid& grid, const std::string& name) {
    return outlineOf(grid, name, file, measures);
  });
}

std::optional<std::string> firstDrawable(const std::filesystem::path& path) {
  SceneFile file;
  file.path = path;
  return GridsOfVdb(file).firstDrawableName();
}

std::optional<std::vector<Scene>> readFrame(const SceneFile& file) {
  return file.path.extension() == ".esvr" ? scenesOf(contentOf(file), file)
                                          : GridsOfVdb(file).frame();
}

std::optional<std::vector<Scene>> readFrameOutlines(const SceneFile& file, bool measures) {
  if (file.path.extension() == ".esvr") return outlinesOf(contentOf(file), file, measures);
  auto scenes = GridsOfVdb(file).frame();
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
    if (!scenes[i].medianDepth) scenes[i].medianDepth = other.medianDepth;
  }
}

// Drawing.

bool hasSum(const Scene& scene) {
  return std::holds_alternative<Field>(scene.content) && scene.encoded &&
         followsFromEllipsoids(*scene.encoded);
}

SceneRenderer::SceneRenderer(const std::vector<Scene>& scenes, const DrawSettings& s) {
  if (scenes.size() == 1) {
    drawAlone(scenes.front(), s);
    return;
  }
  std::vector<DrawnGrid> grids;
  for (const Scene& scene : scenes) grids.push_back(drawnGrid(scene, s));
  renderer_ = makeGridsRenderer(grids, s.device, s.limits);
}

DrawnGrid SceneRenderer::drawnGrid(const Scene& scene, const DrawSettings& s) {
  if (const auto* const grid = std::get_if<VolumeGrid>(&scene.content)) return &grid->volume;
  const StoredGrid& stored = *scene.encoded;
  const DecodeOptions decoding{
      .maxBytes = s.memory.maxBytes, .memory = s.memory.voxels, .keepsNonFinite = false};
  if (hasSum(scene)) {
    const Field& field = std::get<Field>(scene.content);
    if (!s.sums && liesFarApart(field, scene.box))
      requireWithinMemory(estimateDecode(stored, decoding).bytes(decoding.memory),
                          decoding.maxBytes, "the voxels of " + scene.grid);
    DrawnField drawn{&field, voxelRule(stored)};
    drawn.voxels.memory = decoding.memory;
    return drawn;
  }
  decoded_.push_back(decodeGrid(stored, decoding));
  return &decoded_.back();
}

void SceneRenderer::drawAlone(const Scene& scene, const DrawSettings& s) {
  const bool isNano = !s.shaded && (s.device.kind == DeviceKind::kCuda || s.values);
  const auto* const voxels = std::get_if<VolumeGrid>(&scene.content);
  if (voxels && isNano) return sampleNano(*voxels, s);
  const DrawnGrid grid = drawnGrid(scene, s);
  if (const auto* const drawn = std::get_if<DrawnField>(&grid)) {
    renderer_ = makeFieldRenderer(*drawn->field, s.device, s.limits, drawn->voxels);
    return;
  }
  // The bricks of a CUDA device have a table of the space between them, which NanoVDB grids have not.
  const SparseVolume& volume = *std::get<const SparseVolume*>(grid);
  if (isNano && scene.encoded && liesFarApart(std::get<Field>(scene.content), scene.box))
    return sampleNano({scene.encoded->descriptor, volume, 0}, s);
  renderer_ = makeVolumeRenderer(volume, s.device, s.limits);
}

void SceneRenderer::sampleNano(const VolumeGrid& grid, const DrawSettings& s) {
  nano_ = makeNanoVolume(grid, s.values.value_or(NanoValues::kFloat));
  renderer_ = makeNanoRenderer(nano_, s.device, s.limits);
}

}  // namespace esvr::render
