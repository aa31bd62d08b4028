// The public functions that need OpenVDB.

#include "vdb/library.h"

namespace esvr {

std::string vdbVersions() { return vdb::library().vdbVersions(); }

VdbSummary inspectVdb(const std::filesystem::path& path) { return vdb::library().inspectVdb(path); }

VolumeGrid readGrid(const std::filesystem::path& path, const std::string& name,
                    const ReadOptions& options) {
  return vdb::library().readGrid(path, name, options);
}

VolumeGrid readComponent(const std::filesystem::path& path, const std::string& name,
                         std::size_t component, const ReadOptions& options) {
  return vdb::library().readComponent(path, name, component, options);
}

VectorGrid readVector(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  return vdb::library().readVector(path, name, options);
}

PackedGrid readPacked(const std::filesystem::path& path, const std::string& name,
                      const ReadOptions& options) {
  return vdb::library().readPacked(path, name, options);
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
