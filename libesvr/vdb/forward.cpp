// The public functions that need OpenVDB.

#include <utility>

#include "esvr/error.h"
#include "esvr/grid_names.h"
#include "vdb/library.h"

namespace esvr {

std::string vdbVersions() { return vdb::library().vdbVersions(); }

VdbSummary inspectVdb(const std::filesystem::path& path) { return vdb::library().inspectVdb(path); }

namespace {

/// Finds a grid that a user has named.
NamedGrid namedIn(const std::filesystem::path& path, const std::string& name) {
  std::vector<std::string> names;
  for (const GridSummary& grid : inspectVdb(path).grids) names.push_back(grid.name);
  return GridNames(std::move(names)).find(name, path);
}

/// The place of a grid that a user has named, of which components cannot be read.
std::size_t placeIn(const std::filesystem::path& path, const std::string& name) {
  const NamedGrid grid = namedIn(path, name);
  if (grid.component)
    throw BadInput(path.string() + ": \"" + shownName(name) +
                   "\" is a component, which has no components of its own");
  return grid.place;
}

}  // namespace

VolumeGrid readGrid(const std::filesystem::path& path, std::size_t place,
                    const ReadOptions& options) {
  return vdb::library().readGrid(path, place, options);
}

VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                    const ReadOptions& options) {
  const NamedGrid grid = namedIn(path, name);
  return grid.component ? readComponent(path, grid.place, *grid.component, options)
                        : readGrid(path, grid.place, options);
}

VolumeGrid readComponent(const std::filesystem::path& path, std::size_t place,
                         std::size_t component, const ReadOptions& options) {
  return vdb::library().readComponent(path, place, component, options);
}

VolumeGrid readComponent(const std::filesystem::path& path, const std::string& name,
                         std::size_t component, const ReadOptions& options) {
  return readComponent(path, placeIn(path, name), component, options);
}

VectorGrid readVector(const std::filesystem::path& path, std::size_t place,
                      const ReadOptions& options) {
  return vdb::library().readVector(path, place, options);
}

VectorGrid readVector(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  return readVector(path, placeIn(path, name), options);
}

PackedGrid readPacked(const std::filesystem::path& path, std::size_t place,
                      const ReadOptions& options) {
  return vdb::library().readPacked(path, place, options);
}

PackedGrid readPacked(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  const NamedGrid grid = namedIn(path, name);
  if (!grid.component) return readPacked(path, grid.place, options);
  const VolumeGrid volume = readComponent(path, grid.place, *grid.component, options);
  return packed(volume.descriptor, volume.volume);
}

std::vector<CarriedGrid> readCarried(const std::filesystem::path& path,
                                     std::span<const std::size_t> places,
                                     const ReadOptions& options) {
  return vdb::library().readCarried(path, places, options);
}

GridSummary inspectCarried(const CarriedGrid& grid) { return vdb::library().inspectCarried(grid); }

VolumeGrid readGrid(const CarriedGrid& grid, const ReadOptions& options) {
  return vdb::library().readGrid(grid, options);
}

VectorGrid readVector(const CarriedGrid& grid, const ReadOptions& options) {
  return vdb::library().readVector(grid, options);
}

PackedGrid readPacked(const CarriedGrid& grid, const ReadOptions& options) {
  return vdb::library().readPacked(grid, options);
}

void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const VolumeGrid> grids, const WriteOptions& options) {
  std::vector<GridToWrite> all;
  for (const auto& grid : grids) all.emplace_back(&grid);
  writeGrids(path, fileMetadata, all, options);
}

void writeGrids(const std::filesystem::path& path, std::span<const MetaItem> fileMetadata,
                std::span<const GridToWrite> grids, const WriteOptions& options) {
  vdb::library().writeGrids(path, fileMetadata, grids, options);
}

Transform uniformTransform(double voxelSize) { return vdb::library().uniformTransform(voxelSize); }

Transform affineTransform(const std::array<double, 16>& matrix) {
  return vdb::library().affineTransform(matrix);
}

MeshDistance meshDistance(const VolumeGrid& reference, const VolumeGrid& candidate) {
  return vdb::library().meshDistance(reference, candidate);
}

NanoVolume makeNanoVolume(const VolumeGrid& grid, NanoValues values) {
  return vdb::library().makeNanoVolume(grid, values);
}

VoxelPacker::VoxelPacker(const VolumeGrid& grid) : packer_(vdb::library().makePacker(grid)) {}

VoxelPacker::~VoxelPacker() = default;

double VoxelPacker::write(const std::filesystem::path& path, const VoxelPacking& packing) const {
  return packer_->write(path, packing);
}

double secondsToRead(const std::filesystem::path& path, PackedForm form) {
  return vdb::library().secondsToRead(path, form);
}

}  // namespace esvr
