#include "compare/grid_file.h"

#include <utility>

#include "cli/names.h"
#include "esvr/error.h"
#include "esvr/grid_coding.h"

namespace esvr::compare {
namespace {

constexpr std::uint64_t kVolumes = 2;  // the reference and the candidate

ListedGrid listedGrid(const StoredGrid& grid) {
  return {.name = grid.descriptor.name,
          .empty = grid.activeVoxels == 0,
          .valueType = cli::nameOf(grid.descriptor.valueType)};
}

ListedGrid listedGrid(const CarriedGrid& grid) {
  const GridSummary summary = inspectCarried(grid);
  return {.name = grid.name,
          .comparable = summary.isScalar,
          .empty = summary.activeVoxels == 0,
          .valueType = summary.valueType,
          .isVector = summary.isVector};
}

/// A grid of vectors; OpenVDB's name of its type is that of the source.
ListedGrid listedGrid(const EsvrFile& file, const StoredVector& vector) {
  const StoredGrid& first = componentsOf(file, vector).front();
  return {.name = vector.name,
          .comparable = false,
          .empty = first.activeVoxels == 0,
          .valueType = first.descriptor.valueType == ValueType::kDouble ? "vec3d" : "vec3s",
          .isVector = true};
}

ListedGrid listedGrid(const EsvrFile& file, const GridOfFile& grid) {
  if (grid.isVector) return listedGrid(file, file.vectors[grid.index]);
  return grid.isCarried ? listedGrid(file.carried[grid.index]) : listedGrid(file.grids[grid.index]);
}

}  // namespace

GridFile::GridFile(std::filesystem::path path, cli::HostMemory memory)
    : path_(std::move(path)), watched_({path_}), memory_(std::move(memory)) {
  if (path_.extension() != ".esvr") {
    listVdb();
    return;
  }
  esvr_ = std::make_unique<EsvrFile>(readEsvr(path_, {memory_.maxBytes, memory_.voxels}));
  bytes_ = inspectEsvr(path_).fileBytes;
  watched_.requireUnchanged();
  listEsvr();
}

GridFile::GridFile(std::filesystem::path path, const EsvrFile& frame, cli::HostMemory memory)
    : path_(std::move(path)), memory_(std::move(memory)), esvr_(std::make_unique<EsvrFile>(frame)) {
  listEsvr();
}

void GridFile::listEsvr() {
  metadata_ = esvr_->metadata;
  for (const auto& grid : gridsInOrder(*esvr_)) {
    grids_.push_back(listedGrid(*esvr_, grid));
    grids_.back().ofEsvr = grid;
  }
  traits_ = cli::traitsOf(*esvr_);
  nameGrids();
}

void GridFile::nameGrids() {
  std::vector<std::string> names;
  for (const auto& grid : grids_) names.push_back(grid.name);
  names_.emplace(std::move(names));
  for (std::size_t g = 0; g < grids_.size(); ++g) grids_[g].uniqueName = names_->unique(g);
}

void GridFile::listVdb() {
  VdbSummary summary = inspectVdb(path_);
  bytes_ = summary.fileBytes;
  metadata_ = std::move(summary.metadata);
  for (const auto& grid : summary.grids) {
    grids_.push_back({.name = grid.name,
                      .comparable = grid.isScalar,
                      .empty = grid.activeVoxels == 0,
                      .valueType = grid.valueType,
                      .storedBytes = grid.storedBytes,
                      .isVector = grid.isVector});
    whyNoBytes_.push_back(grid.whyNotCarried);
  }
  traits_ = cli::traitsOf(summary);
  nameGrids();
}

std::size_t GridFile::find(const std::string& name) const { return names_->findWhole(name, path_); }

std::size_t GridFile::firstWithVoxels() const {
  for (std::size_t g = 0; g < grids_.size(); ++g)
    if (grids_[g].comparable && !grids_[g].empty) return g;
  throw BadInput(path_.string() + ": no grid of type float or double has an active voxel");
}

bool GridFile::hasBytes(std::size_t g) const {
  return esvr_ ? grids_[g].ofEsvr.isCarried : whyNoBytes_[g].empty();
}

std::optional<CarriedGrid> GridFile::bytesOf(std::size_t g) const {
  if (!hasBytes(g)) return std::nullopt;
  if (esvr_) return esvr_->carried[grids_[g].ofEsvr.index];
  auto grids =
      readCarried(path_, {&g, 1}, {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
  return ofSameFile(std::move(grids.front()));
}

VolumeGrid GridFile::read(std::size_t g) const {
  const ReadOptions options{.allowEmpty = true,
                            .maxBytes = memory_.maxBytes,
                            .memory = memory_.voxels,
                            .volumes = kVolumes};
  if (!esvr_) return ofSameFile(readGrid(path_, g, options));
  const GridOfFile& place = grids_[g].ofEsvr;
  if (place.isCarried) return readGrid(esvr_->carried[place.index], options);
  VolumeGrid grid;
  grid.descriptor = esvr_->grids.at(place.index).descriptor;
  grid.volume = decodeGrid(esvr_->grids[place.index],
                           {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
  return grid;
}

VectorGrid GridFile::readVectors(std::size_t g) const {
  const ReadOptions options{
      .maxBytes = memory_.maxBytes, .memory = memory_.voxels, .volumes = kVolumes};
  if (!esvr_) return ofSameFile(readVector(path_, g, options));
  const GridOfFile& place = grids_[g].ofEsvr;
  if (place.isCarried) return readVector(esvr_->carried[place.index], options);
  const StoredVector& vector = esvr_->vectors.at(place.index);
  return decodeVector(vector.name, componentsOf(*esvr_, vector),
                      {.maxBytes = memory_.maxBytes, .memory = memory_.voxels});
}

}  // namespace esvr::compare
